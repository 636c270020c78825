// One interpolant, several threads. Under the thread sanitizer (preset tsan) this shows that evaluating shares nothing
// that is written. TBB, whose code the sanitizer does not see, is held to the calling thread: the threads here are all
// there are.
#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include <nlohmann/json.hpp>
#include <thread>

#include "framework/interpolant.hpp"
#include "reconstruction/registry.hpp"
#include "support/test_meshes.hpp"

namespace halfgrad {
namespace {

constexpr int num_threads_here = 4, num_frames = 6;

template <class Scalar>
Values<Scalar> frame(const Mesh& mesh, int number) {
  Values<double> values = mesh.vertices();
  for (Index v = 0; v < mesh.num_vertices(); ++v)
    values(v, 0) += 0.05 * std::sin(3 * values(v, 1) + number) + 0.02 * number * values(v, 0) * values(v, 0);
  return values.cast<Scalar>();
}

// Every thread evaluates every frame, in an order of its own, in all the ways there are.
template <class Scalar>
void expect_the_bits_of_one_thread(const Mesh& mesh, const char* rule, const nlohmann::json& reconstructor) {
  const Embedding embedding = embed(mesh, test::random_points_inside(mesh, 500, 3));
  const Reconstruction reconstruction =
      make_reconstructor(reconstructor)
          .reconstructor->reconstruct(CellGradients(mesh), active_vertices(mesh, embedding));
  const Interpolant<Scalar> interpolant(mesh, embedding, named_rule(rule), &reconstruction);
  std::vector<Values<Scalar>> frames, expected, gradients;
  for (int f = 0; f < num_frames; ++f) {
    frames.push_back(frame<Scalar>(mesh, f));
    expected.push_back(interpolant.evaluate(frames.back()));
    gradients.push_back(interpolant.gradient(frames.back()));
  }
  std::vector<int> num_equal(num_threads_here, 0);
  std::vector<std::thread> threads;
  for (int t = 0; t < num_threads_here; ++t)
    threads.emplace_back([&, t] {
      Workspace<Scalar> workspace, sorted_workspace;
      Values<Scalar> out, sorted;
      for (int i = 0; i < num_frames; ++i) {
        const int f = (i + t) % num_frames;
        interpolant.evaluate(frames[f], out, workspace);
        interpolant.update_sorted(frames[f], sorted, sorted_workspace);
        bool equal = out == expected[f] && interpolant.gradient(frames[f]) == gradients[f];
        for (Index s = 0; s < interpolant.num_points(); ++s)
          equal = equal && sorted.row(s) == expected[f].row(interpolant.permutation()[s]);
        num_equal[t] += equal;
      }
    });
  for (std::thread& thread : threads) thread.join();
  for (int t = 0; t < num_threads_here; ++t) EXPECT_EQ(num_equal[t], num_frames) << rule << " thread " << t;
}

class Concurrency : public testing::Test {
  tbb::global_control limit_{tbb::global_control::max_allowed_parallelism, 1};
};

TEST_F(Concurrency, TetrahedraInFloatAndDouble) {
  const Mesh mesh = test::lattice<Tetrahedron>(3, 0.2, 1);
  expect_the_bits_of_one_thread<float>(mesh, "phong", "adaptive");
  expect_the_bits_of_one_thread<double>(mesh, "phong", "kriging");
  expect_the_bits_of_one_thread<double>(mesh, "dual_taylor", {{"kriging", {{"drift", "cubic"}}}});
}

TEST_F(Concurrency, OtherElements) {
  expect_the_bits_of_one_thread<float>(test::lattice<Hexahedron>(3, 0.2, 1), "hermite", "chandrashekar_garg");
  expect_the_bits_of_one_thread<double>(test::lattice<Quadrilateral>(6, 0.2, 1), "phong", "kriging");
  expect_the_bits_of_one_thread<double>(test::warped_mixed_mesh(), "phong", "chandrashekar_garg");
}

}  // namespace
}  // namespace halfgrad
