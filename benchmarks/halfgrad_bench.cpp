// halfgrad_bench WORKLOAD.bin ROUNDS MAX_POINTS: times frames, location and bind on one workload, one JSON line each.
// Every round runs each operation once in turn, so that all see the same load of the machine; a frame is repeated
// within its turn and the fastest repetition counts. Compare numbers of one round only.
#include <fmt/format.h>
#include <tbb/global_control.h>

#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <functional>

#include "benchmarks/baselines.hpp"
#include "benchmarks/workload.hpp"
#include "framework/cell_locator.hpp"
#include "framework/error.hpp"
#include "framework/interpolant.hpp"
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

void run(const std::string& path, int rounds, std::int64_t max_points, int threads) {
  const tbb::global_control limit(tbb::global_control::max_allowed_parallelism, static_cast<std::size_t>(threads));
  const Workload workload = read_workload(path, max_points);
  const Mesh& mesh = workload.mesh;
  // Points on the surface of a workload may be outside by a rounding.
  EmbedOptions nearest;
  nearest.outside = Outside::nearest;
  const Embedding embedding = embed(mesh, workload.points, nearest);
  const Reconstruction reconstruction =
      ChandrashekarGarg().reconstruct(CellGradients(mesh), active_vertices(mesh, embedding));
  // Hessians of no meaning on the same stencils: what dual_taylor costs next to phong.
  Reconstruction with_hessians = reconstruction;
  with_hessians.stencils.hessian_weights.assign(6 * static_cast<std::size_t>(reconstruction.stencils.num_entries()), 0);
  const auto bound = [&]<class Scalar>(Scalar, const char* rule) {
    return Frame<Scalar>{Interpolant<Scalar>(mesh, embedding, named_rule(rule), &with_hessians), {}, {}};
  };
  auto linear = bound(float(), "linear"), phong = bound(float(), "phong"), hermite = bound(float(), "hermite");
  auto dual_taylor = bound(float(), "dual_taylor");
  // What the stencils of other reconstructors cost.
  const auto bound_with = [&](const VertexGradientReconstructor& reconstructor, const char* rule) {
    const Reconstruction own = reconstructor.reconstruct(CellGradients(mesh), active_vertices(mesh, embedding));
    return Frame<float>{Interpolant<float>(mesh, embedding, named_rule(rule), &own), {}, {}};
  };
  auto phong_lean = bound_with(Kriging({.patch = KrigingPatch::lean}), "phong");
  auto phong_kriging = bound_with(Kriging(), "phong"), phong_adaptive = bound_with(Adaptive(), "phong");
  auto dual_taylor_kriging = bound_with(Kriging({.drift = KrigingDrift::cubic}), "dual_taylor");
  auto linear_user = bound(float(), "linear"), phong_user = bound(float(), "phong");
  auto phong_double = bound(double(), "phong");
  const Values<float> values = workload.deformed.cast<float>();
  const ScalarLinear scalar_linear(mesh, embedding);
  PaperStyle paper_style(mesh, embedding, workload.points);
  std::vector<float> scalar_out(3 * static_cast<std::size_t>(embedding.num_points())), paper_out(scalar_out);

  const Offset n = embedding.num_points();
  const int frames = std::max<int>(3, static_cast<int>(1'000'000 / std::max<Offset>(n, 1)));
  const std::vector<Operation> operations = {
      {"linear", frames, [&] { linear.sorted(values); }},
      {"phong", frames, [&] { phong.sorted(values); }},
      {"hermite", frames, [&] { hermite.sorted(values); }},
      {"dual_taylor", frames, [&] { dual_taylor.sorted(values); }},
      {"phong_lean", frames, [&] { phong_lean.sorted(values); }},
      {"phong_kriging", frames, [&] { phong_kriging.sorted(values); }},
      {"phong_adaptive", frames, [&] { phong_adaptive.sorted(values); }},
      {"dual_taylor_kriging", frames, [&] { dual_taylor_kriging.sorted(values); }},
      {"phong_double", frames, [&] { phong_double.sorted(workload.deformed); }},
      {"linear_user_order", frames, [&] { linear_user.user_order(values); }},
      {"phong_user_order", frames, [&] { phong_user.user_order(values); }},
      {"scalar_linear", frames, [&] { scalar_linear.evaluate(values.data(), scalar_out.data()); }},
      {"paper_style", 1, [&] { paper_style.evaluate(values.data(), paper_out.data()); }},
      {"copy", frames, [&] { std::memmove(paper_out.data(), scalar_out.data(), scalar_out.size() * sizeof(float)); }},
      {"locate", 1, [&] { locate(mesh, workload.points, nearest.tolerance); }},
      {"bind", 1,
       [&] {
         const Embedding located = embed(mesh, workload.points, nearest);
         const Reconstruction stencils =
             ChandrashekarGarg().reconstruct(CellGradients(mesh), active_vertices(mesh, located));
         Interpolant<float>(mesh, located, named_rule("phong"), &stencils);
       }},
  };
  // A first pass over everything touches all memory, and shows that the contestants agree.
  for (const Operation& operation : operations) operation.run();
  float difference = 0;
  paper_style.evaluate(values.data(), paper_out.data());
  for (std::size_t i = 0; i < paper_out.size(); ++i)
    difference = std::max(difference, std::abs(paper_out[i] - phong_user.out.data()[i]));
  const BindReport& report = phong.interpolant.report();
  fmt::print(
      "{{\"impl\":\"halfgrad\",\"op\":\"report\",\"n\":{},\"active_cells\":{},\"active_vertices\":{},"
      "\"stencil_entries\":{},\"bytes\":{},\"difference_to_paper_style\":{:.3g}}}\n",
      n, report.num_active_cells, report.num_active_vertices, report.num_stencil_entries, report.bytes, difference);
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
  if (argc < 4 || argc > 5) {
    fmt::print(stderr, "usage: halfgrad_bench WORKLOAD.bin ROUNDS MAX_POINTS [THREADS]\n");
    return 2;
  }
  try {
    halfgrad::benchmarks::run(argv[1], std::atoi(argv[2]), std::atoll(argv[3]), argc == 5 ? std::atoi(argv[4]) : 1);
  } catch (const halfgrad::Error& error) {
    fmt::print(stderr, "{}\n", error.what());
    return 2;
  }
}
