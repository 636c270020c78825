// bind_bench WORKLOAD ROUNDS MAX_POINTS [THREADS]: times location, bind, the parts of bind with the reconstructor
// chandrashekar_garg and a frame of phong, one JSON line each. Every round runs each operation once in turn, the frame
// several times, of which the fastest counts; compare numbers of one round only. The line `report` has the size of the
// binding, and how much the first bind added to the process at its peak.
#include <fmt/format.h>
#include <tbb/global_control.h>

#include <algorithm>
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <string>
#include <utility>

#include "benchmarks/peak_memory.hpp"
#include "benchmarks/workload.hpp"
#include "framework/cell_locator.hpp"
#include "framework/error.hpp"
#include "framework/interpolant.hpp"
#include "reconstruction/cell_averages.hpp"

namespace halfgrad::benchmarks {
namespace {

class Stopwatch {
 public:
  double lap() {
    const auto now = std::chrono::steady_clock::now();
    return std::chrono::duration<double>(now - std::exchange(start_, now)).count();
  }

 private:
  std::chrono::steady_clock::time_point start_ = std::chrono::steady_clock::now();
};

void run(const std::string& name, int rounds, std::int64_t max_points, int threads) {
  const tbb::global_control limit(tbb::global_control::max_allowed_parallelism, static_cast<std::size_t>(threads));
  const Workload workload =
      name.ends_with(".bin") ? read_workload(name, max_points) : lattice_workload(name, max_points);
  const Mesh& mesh = workload.mesh;
  // Points on the surface of a workload may be outside by a rounding.
  EmbedOptions nearest;
  nearest.outside = Outside::nearest;
  struct {
    double embed, order, incidence, reconstruct, pack;
  } parts{};
  const auto bind = [&] {
    Stopwatch watch;
    const Embedding embedding = embed(mesh, workload.points, nearest);
    parts.embed = watch.lap();
    const BindingOrder order = binding_order(mesh, embedding);
    parts.order = watch.lap();
    const CellGradients cells(mesh);
    parts.incidence = watch.lap();
    const Reconstruction stencils = ChandrashekarGarg().reconstruct(cells, order.vertices);
    parts.reconstruct = watch.lap();
    Interpolant<float> interpolant(mesh, embedding, order, named_rule("phong"), &stencils);
    parts.pack = watch.lap();
    return interpolant;
  };

  const PeakMemory memory;
  const BindReport report = bind().report();
  const std::int64_t peak = memory.added_bytes();
  const Offset allowed = 20 * static_cast<Offset>(report.num_points) +
                         200 * static_cast<Offset>(report.num_active_cells) + 24 * report.num_stencil_entries;
  fmt::print(
      "{{\"impl\":\"halfgrad\",\"op\":\"report\",\"seconds\":0,\"n\":{},\"active_cells\":{},\"active_vertices\":{},"
      "\"stencil_entries\":{},\"bytes\":{},\"bytes_allowed\":{},\"peak_of_bind\":{}}}\n",
      report.num_points, report.num_active_cells, report.num_active_vertices, report.num_stencil_entries, report.bytes,
      allowed, peak);

  const Values<float> values = workload.deformed.cast<float>();
  Values<float> out;
  Workspace<float> workspace;
  const auto frames = std::max<Offset>(3, 1'000'000 / std::max<Offset>(report.num_points, 1));
  for (int round = 0; round < rounds; ++round) {
    Stopwatch watch;
    locate(mesh, workload.points, nearest.tolerance);
    const double located = watch.lap();
    const Interpolant<float> interpolant = bind();
    const double bound = watch.lap();
    interpolant.evaluate_sorted(values, out, workspace);
    double frame = watch.lap();
    for (Offset repetition = 0; repetition < frames; ++repetition) {
      interpolant.evaluate_sorted(values, out, workspace);
      frame = std::min(frame, watch.lap());
    }
    const std::pair<const char*, double> operations[] = {{"locate", located},
                                                         {"bind", bound},
                                                         {"bind.embed", parts.embed},
                                                         {"bind.order", parts.order},
                                                         {"bind.incidence", parts.incidence},
                                                         {"bind.reconstruct", parts.reconstruct},
                                                         {"bind.pack", parts.pack},
                                                         {"frame", frame}};
    for (const auto& [operation, time] : operations)
      fmt::print("{{\"impl\":\"halfgrad\",\"op\":\"{}\",\"seconds\":{:.9g},\"n\":{},\"round\":{}}}\n", operation, time,
                 report.num_points, round);
    std::fflush(stdout);
  }
}

}  // namespace
}  // namespace halfgrad::benchmarks

int main(int argc, char** argv) {
  if (argc < 4 || argc > 5) {
    fmt::print(stderr, "usage: bind_bench WORKLOAD.bin|ELEMENT:CELLS ROUNDS MAX_POINTS [THREADS]\n");
    return 2;
  }
  try {
    halfgrad::benchmarks::run(argv[1], std::atoi(argv[2]), std::atoll(argv[3]), argc == 5 ? std::atoi(argv[4]) : 1);
  } catch (const halfgrad::Error& error) {
    fmt::print(stderr, "{}\n", error.what());
    return 2;
  }
}
