// element_bench: bind, gradients at vertices and a frame, by element × reconstructor × size, under Google Benchmark.
//
//   element_bench --benchmark_filter='evaluate/hexahedron'
#include <benchmark/benchmark.h>
#include <fmt/format.h>

#include <nlohmann/json.hpp>

#include "benchmarks/workload.hpp"
#include "framework/interpolant.hpp"
#include "reconstruction/registry.hpp"

namespace halfgrad::benchmarks {
namespace {

struct Size {
  int cells;  // along each axis
  Index num_points;
};

void bind(::benchmark::State& state, const Workload& workload, const VertexGradientReconstructor& reconstructor) {
  for (auto _ : state) {
    const Embedding embedding = embed(workload.mesh, workload.points);
    const Reconstruction stencils =
        reconstructor.reconstruct(CellGradients(workload.mesh), active_vertices(workload.mesh, embedding));
    ::benchmark::DoNotOptimize(Interpolant<float>(workload.mesh, embedding, named_rule("phong"), &stencils));
  }
  state.SetItemsProcessed(state.iterations() * workload.points.rows());
}

void gradients(::benchmark::State& state, const Workload& workload, const VertexGradientReconstructor& reconstructor) {
  std::vector<Index> vertices(static_cast<std::size_t>(workload.mesh.num_vertices()));
  for (std::size_t v = 0; v < vertices.size(); ++v) vertices[v] = static_cast<Index>(v);
  const Reconstruction made = reconstructor.reconstruct(CellGradients(workload.mesh), vertices);
  const Values<float> values = workload.deformed.cast<float>();
  for (auto _ : state)
    ::benchmark::DoNotOptimize(made.blend ? blended_gradients(made, values) : apply_stencils(made.stencils, values));
  state.SetItemsProcessed(state.iterations() * workload.mesh.num_vertices());
}

void evaluate(::benchmark::State& state, const Workload& workload, const VertexGradientReconstructor& reconstructor) {
  const Embedding embedding = embed(workload.mesh, workload.points);
  const Reconstruction stencils =
      reconstructor.reconstruct(CellGradients(workload.mesh), active_vertices(workload.mesh, embedding));
  const Interpolant<float> interpolant(workload.mesh, embedding, named_rule("phong"), &stencils);
  const Values<float> values = workload.deformed.cast<float>();
  Values<float> out;
  Workspace<float> workspace;
  for (auto _ : state) interpolant.evaluate_sorted(values, out, workspace);
  state.SetItemsProcessed(state.iterations() * workload.points.rows());
}

// Workloads are made when their benchmark runs: a filter pays for what it names.
void add(const std::string& element, const std::string& reconstructor, const Size& size) {
  const auto add_one = [&](const char* what, auto run) {
    ::benchmark::RegisterBenchmark(
        fmt::format("{}/{}/{}/{}x{}", what, element, reconstructor, size.cells, size.num_points).c_str(),
        [=](::benchmark::State& state) {
          const Workload workload = lattice_workload(fmt::format("{}:{}", element, size.cells), size.num_points);
          run(state, workload, *make_reconstructor(nlohmann::json(reconstructor)).reconstructor);
        })
        ->Unit(::benchmark::kMillisecond);
  };
  add_one("bind", bind);
  add_one("gradients", gradients);
  add_one("evaluate", evaluate);
}

}  // namespace
}  // namespace halfgrad::benchmarks

int main(int argc, char** argv) {
  using halfgrad::benchmarks::add;
  for (const char* element : {"triangle", "quadrilateral"})
    for (const char* reconstructor : {"chandrashekar_garg", "kriging", "adaptive"})
      for (const halfgrad::benchmarks::Size size : {halfgrad::benchmarks::Size{20, 10000}, {100, 250000}})
        add(element, reconstructor, size);
  for (const char* element : {"tetrahedron", "pyramid", "wedge", "hexahedron"})
    for (const char* reconstructor : {"chandrashekar_garg", "kriging", "adaptive"})
      for (const halfgrad::benchmarks::Size size : {halfgrad::benchmarks::Size{6, 10000}, {18, 250000}})
        add(element, reconstructor, size);
  benchmark::Initialize(&argc, argv);
  if (benchmark::ReportUnrecognizedArguments(argc, argv)) return 2;
  benchmark::RunSpecifiedBenchmarks();
}
