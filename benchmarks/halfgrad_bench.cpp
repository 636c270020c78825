// halfgrad_bench WORKLOAD ROUNDS MAX_POINTS [THREADS [OP,OP,...]]: times frames, location and bind on one workload, one
// JSON line each; the named operations alone where there are some. Every round runs each operation once in turn, so
// that all see the same load of the machine; a frame is repeated within its turn and the fastest repetition counts.
// Compare numbers of one round only.
#include <fmt/format.h>
#include <tbb/global_control.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <functional>
#include <optional>

#include "benchmarks/baselines.hpp"
#include "benchmarks/peak_memory.hpp"
#include "benchmarks/workload.hpp"
#include "framework/cell_locator.hpp"
#include "framework/error.hpp"
#include "framework/interpolant.hpp"
#include "framework/point_selection.hpp"
#include "reconstruction/adaptive.hpp"
#include "reconstruction/cell_averages.hpp"
#include "reconstruction/kriging.hpp"

namespace halfgrad::benchmarks {
namespace {

struct Operation {
  const char* name;
  int repetitions;
  std::function<void()> run;
};

template <class Scalar>
struct Frame {
  Interpolant<Scalar> interpolant;
  Workspace<Scalar> workspace;
  Values<Scalar> out;

  void sorted(const Values<Scalar>& values) { interpolant.evaluate_sorted(values, out, workspace); }
  void user_order(const Values<Scalar>& values) { interpolant.evaluate(values, out, workspace); }
};

double seconds(const std::function<void()>& run) {
  const auto start = std::chrono::steady_clock::now();
  run();
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
}

// Values of which a tenth of the vertices, a part of the mesh, moves from frame to frame.
class MovingTenth {
 public:
  MovingTenth(const Points& rest, const Values<float>& values) {
    std::vector<double> sorted(rest.col(0).begin(), rest.col(0).end());
    const auto cut = sorted.begin() + static_cast<std::ptrdiff_t>(sorted.size() / 10);
    std::nth_element(sorted.begin(), cut, sorted.end());
    frames_ = {values, values};
    for (Eigen::Index v = 0; v < rest.rows(); ++v)
      if (rest(v, 0) < *cut) frames_[1].row(v).array() += 0.01f;
  }
  const Values<float>& next() { return frames_[static_cast<std::size_t>(frame_++ % 2)]; }

 private:
  std::array<Values<float>, 2> frames_;
  int frame_ = 0;
};

// `only` names operations between commas; all where it is empty.
void run(const std::string& name, int rounds, std::int64_t max_points, int threads, const std::string& only) {
  const tbb::global_control limit(tbb::global_control::max_allowed_parallelism, static_cast<std::size_t>(threads));
  const bool is_lattice = !name.ends_with(".bin");
  const Workload workload = is_lattice ? lattice_workload(name, max_points) : read_workload(name, max_points);
  const Mesh& mesh = workload.mesh;
  // Points on the surface of a workload may be outside by a rounding.
  EmbedOptions nearest;
  nearest.outside = Outside::nearest;
  const auto bind = [&] {
    const Embedding located = embed(mesh, workload.points, nearest);
    const Reconstruction stencils =
        ChandrashekarGarg().reconstruct(CellGradients(mesh), active_vertices(mesh, located));
    return Interpolant<float>(mesh, located, named_rule("phong"), &stencils);
  };
  const PeakMemory memory;
  const BindReport report = bind().report();
  const std::int64_t peak_of_bind = memory.added_bytes();

  const Embedding embedding = embed(mesh, workload.points, nearest);
  const Reconstruction reconstruction =
      ChandrashekarGarg().reconstruct(CellGradients(mesh), active_vertices(mesh, embedding));
  const auto bound = [&]<class Scalar>(Scalar, const char* rule, const Embedding& points) {
    return Frame<Scalar>{Interpolant<Scalar>(mesh, points, named_rule(rule), &reconstruction), {}, {}};
  };
  auto linear = bound(float(), "linear", embedding), phong = bound(float(), "phong", embedding);
  auto linear_user = bound(float(), "linear", embedding), phong_user = bound(float(), "phong", embedding);
  auto phong_double = bound(double(), "phong", embedding);
  auto updated = bound(float(), "phong", embedding);
  // A tenth of the points: a part of the scene as a camera sees it, and a coarser level of detail.
  const auto sorted = phong.interpolant.permutation();
  std::vector<Index> every_tenth;
  for (std::size_t s = 0; s < sorted.size(); s += 10) every_tenth.push_back(sorted[s]);
  auto near_tenth = bound(float(), "phong", select_points(embedding, sorted.first(every_tenth.size())));
  auto sparse_tenth = bound(float(), "phong", select_points(embedding, every_tenth));
  // What the stencils of other reconstructors cost.
  const auto reconstructed = [&](const VertexGradientReconstructor& reconstructor) {
    return reconstructor.reconstruct(CellGradients(mesh), active_vertices(mesh, embedding));
  };
  const auto bound_with = [&](const Reconstruction& own, const char* rule) {
    return Frame<float>{Interpolant<float>(mesh, embedding, named_rule(rule), &own), {}, {}};
  };
  const Reconstruction cubic = reconstructed(Kriging({.drift = KrigingDrift::cubic}));
  auto phong_lean = bound_with(reconstructed(Kriging({.patch = KrigingPatch::lean})), "phong");
  auto phong_kriging = bound_with(reconstructed(Kriging()), "phong");
  auto phong_kriging_cubic = bound_with(cubic, "phong"), dual_taylor_kriging = bound_with(cubic, "dual_taylor");
  auto phong_adaptive = bound_with(reconstructed(Adaptive()), "phong");
  auto hermite = bound_with(reconstruction, "hermite");
  // Hessians of no meaning on the same stencils: what dual_taylor costs next to phong.
  Reconstruction with_hessians = reconstruction;
  with_hessians.stencils.hessian_weights.assign(
      static_cast<std::size_t>(num_symmetric(mesh.gdim()) * reconstruction.stencils.num_entries()), 0);
  auto dual_taylor = bound_with(with_hessians, "dual_taylor");
  const Values<float> values = workload.deformed.cast<float>();
  MovingTenth moving(mesh.vertices(), values);

  const Offset n = embedding.num_points();
  const int frames = std::max<int>(3, static_cast<int>(1'000'000 / std::max<Offset>(n, 1)));
  const std::size_t num_results = static_cast<std::size_t>(n) * static_cast<std::size_t>(mesh.gdim());
  std::vector<float> copied(num_results), copy(num_results);
  std::vector<Operation> operations = {
      {"linear", frames, [&] { linear.sorted(values); }},
      {"phong", frames, [&] { phong.sorted(values); }},
      {"phong_lean", frames, [&] { phong_lean.sorted(values); }},
      {"phong_kriging", frames, [&] { phong_kriging.sorted(values); }},
      {"phong_adaptive", frames, [&] { phong_adaptive.sorted(values); }},
      {"hermite", frames, [&] { hermite.sorted(values); }},
      {"dual_taylor", frames, [&] { dual_taylor.sorted(values); }},
      {"phong_kriging_cubic", frames, [&] { phong_kriging_cubic.sorted(values); }},
      {"dual_taylor_kriging", frames, [&] { dual_taylor_kriging.sorted(values); }},
      {"phong_double", frames, [&] { phong_double.sorted(workload.deformed); }},
      {"linear_user_order", frames, [&] { linear_user.user_order(values); }},
      {"phong_user_order", frames, [&] { phong_user.user_order(values); }},
      {"phong_unchanged", frames, [&] { updated.interpolant.update_sorted(values, updated.out, updated.workspace); }},
      {"phong_tenth_moved", frames,
       [&] { updated.interpolant.update_sorted(moving.next(), updated.out, updated.workspace); }},
      {"phong_near_tenth", frames, [&] { near_tenth.sorted(values); }},
      {"phong_sparse_tenth", frames, [&] { sparse_tenth.sorted(values); }},
      // Every cell within the tolerance: the most that it can save.
      {"phong_all_linear", frames,
       [&] { phong.interpolant.evaluate_sorted(values, phong.out, phong.workspace, {.tolerance = 1e30}); }},
      {"copy", frames, [&] { std::memmove(copy.data(), copied.data(), copy.size() * sizeof(float)); }},
      {"locate", 1, [&] { locate(mesh, workload.points, nearest.tolerance); }},
      {"bind", 1, [&] { bind(); }},
  };
  // What more threads bring, within one process.
  const auto on_one_thread = [](auto& frame, const Values<float>& at) {
    const tbb::global_control one(tbb::global_control::max_allowed_parallelism, 1);
    frame.sorted(at);
  };
  if (threads > 1) {
    operations.push_back({"linear_one_thread", frames, [&] { on_one_thread(linear, values); }});
    operations.push_back({"phong_one_thread", frames, [&] { on_one_thread(phong, values); }});
  }
  const bool all_tetrahedra = mesh.blocks().size() == 1 && element_name(mesh, 0) == Tetrahedron::name;
  std::optional<ScalarLinear> scalar_linear;
  std::optional<PaperStyle> paper_style;
  if (all_tetrahedra) {
    scalar_linear.emplace(mesh, embedding);
    paper_style.emplace(mesh, embedding, workload.points);
    operations.push_back({"scalar_linear", frames, [&] { scalar_linear->evaluate(values.data(), copied.data()); }});
    operations.push_back({"paper_style", 1, [&] { paper_style->evaluate(values.data(), copied.data()); }});
  }
  if (!only.empty())
    std::erase_if(operations, [&](const Operation& operation) {
      return ("," + only + ",").find(fmt::format(",{},", operation.name)) == std::string::npos;
    });
  // A first pass over everything touches all memory, and shows that the contestants agree.
  for (const Operation& operation : operations) operation.run();
  Values<float> reference = phong.interpolant.evaluate(values, {.kernel = Kernel::plain});
  if (all_tetrahedra) {
    paper_style->evaluate(values.data(), reference.data());
  }
  phong_user.user_order(values);
  const float difference = (reference - phong_user.out).cwiseAbs().maxCoeff();
  fmt::print(
      "{{\"impl\":\"halfgrad\",\"op\":\"report\",\"n\":{},\"active_cells\":{},\"active_vertices\":{},"
      "\"stencil_entries\":{},\"bytes\":{},\"peak_of_bind\":{},\"difference_to_baseline\":{:.3g}}}\n",
      n, report.num_active_cells, report.num_active_vertices, report.num_stencil_entries, report.bytes, peak_of_bind,
      difference);
  for (int round = 0; round < rounds; ++round)
    for (const Operation& operation : operations) {
      double best = seconds(operation.run);
      for (int r = 1; r < operation.repetitions; ++r) best = std::min(best, seconds(operation.run));
      fmt::print("{{\"impl\":\"halfgrad\",\"op\":\"{}\",\"seconds\":{:.9g},\"n\":{},\"round\":{}}}\n", operation.name,
                 best, n, round);
      std::fflush(stdout);
    }
}

}  // namespace
}  // namespace halfgrad::benchmarks

int main(int argc, char** argv) {
  if (argc < 4 || argc > 6) {
    fmt::print(stderr, "usage: halfgrad_bench WORKLOAD.bin|ELEMENT:CELLS ROUNDS MAX_POINTS [THREADS [OP,OP,...]]\n");
    return 2;
  }
  try {
    halfgrad::benchmarks::run(argv[1], std::atoi(argv[2]), std::atoll(argv[3]), argc >= 5 ? std::atoi(argv[4]) : 1,
                              argc == 6 ? argv[5] : "");
  } catch (const halfgrad::Error& error) {
    fmt::print(stderr, "{}\n", error.what());
    return 2;
  }
}
