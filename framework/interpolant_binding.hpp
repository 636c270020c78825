// What an interpolant holds after bind. Internal to the framework.
#pragma once

#include <algorithm>
#include <cmath>
#include <limits>

#include "framework/edge_windows.hpp"
#include "framework/error.hpp"
#include "framework/interpolant.hpp"
#include "framework/large_array.hpp"
#include "framework/parallel.hpp"

namespace halfgrad {

// Room for `count` numbers; its content is not kept.
template <class Scalar>
Scalar* reserve(std::vector<kernels::CacheLine>& memory, Offset count) {
  const auto bytes = static_cast<std::size_t>(count) * sizeof(Scalar);
  const std::size_t num_lines = (bytes + sizeof(kernels::CacheLine) - 1) / sizeof(kernels::CacheLine);
  if (memory.size() < num_lines) {
    memory.clear();
    reserve_large(memory, num_lines);
    memory.resize(num_lines);
  }
  return reinterpret_cast<Scalar*>(memory.data());
}

// Vertices a task where a loop over vertices is worth a second thread.
inline Offset vertex_grain(Offset num_vertices) { return num_vertices < 20'000 ? num_vertices : 2048; }

// Calls f with a std::integral_constant of the number of columns where it is 1, 2 or 3, else of −1.
template <class Function>
void with_columns(Eigen::Index columns, Function&& f) {
  switch (columns) {
    case 1:
      return f(std::integral_constant<int, 1>());
    case 2:
      return f(std::integral_constant<int, 2>());
    case 3:
      return f(std::integral_constant<int, 3>());
    default:
      return f(std::integral_constant<int, -1>());
  }
}

inline bool is_fast_width(Eigen::Index columns) { return columns >= 1 && columns <= kernels::max_fast_columns; }

template <class Scalar>
struct Interpolant<Scalar>::Binding {
  // Points a task; below the threshold a frame is too short to wake a second thread for.
  static constexpr Offset points_per_task = 8192;
  static constexpr Offset parallel_threshold = 200'000;

  // The cells of one element type that hold points: one run of points a cell.
  //   nodes        [run][node]          number of the vertex
  //   rest         [run][node][axis]    rest position relative to the run's first node; one run more than there is
  //   first        [run]                position of the run's first point in the block
  //   local        [point][axis]        ξ; for simplices of a point outside too
  //   edges        of simplices whose rule takes gradients but no Hessians (kernels/cell_polynomial.hpp)
  //   affine       [run]                1 where x(ξ) is affine (polynomial elements but simplices)
  //   offset       [point]              row of `offsets` for points outside, else −1 (empty where no point is outside)
  //   extrapolates [run]                1 where a point is outside (empty where none is)
  template <class E>
  struct Runs {
    using element = E;
    Index base = 0;  // sorted position of the block's first point
    LargeArray<std::array<Index, E::num_nodes>> nodes;
    LargeArray<std::array<std::array<Scalar, E::dim>, E::num_nodes>> rest;
    std::vector<Index> first;
    std::vector<std::uint8_t> affine;
    std::vector<Scalar> local;
    EdgeWindows<Scalar> edges;
    std::vector<Index> offset;
    std::vector<std::array<Scalar, E::dim>> offsets;
    std::vector<std::uint8_t> extrapolates;

    Index num_runs() const { return static_cast<Index>(nodes.size()); }
    Index num_points() const { return first.back(); }
    ReferencePoint<E> xi(Index p) const {
      ReferencePoint<E> result;
      for (int k = 0; k < E::dim; ++k) result[k] = static_cast<double>(local[static_cast<Offset>(p) * E::dim + k]);
      return result;
    }
    // Weights of one point.
    NodeVector<E> beta(Index p) const {
      const ReferencePoint<E> at = xi(p);
      NodeVector<E> result = E::shape(at);
      if (!offset.empty() && offset[p] >= 0) {
        const NodeMatrix<E> gradient = E::shape_gradient(at);
        for (int k = 0; k < E::dim; ++k) result += gradient.col(k) * static_cast<double>(offsets[offset[p]][k]);
      }
      return result;
    }
  };
  using AnyRuns = Elements::apply<std::variant, Runs>;

  // Rows of the active vertices in the numbering of `vertices`, in groups of four entries
  // (kernels/cell_polynomial.hpp). What fills a row up to whole groups is the vertex itself with weights of zero.
  struct Stencils {
    int width = 0;  // weights of an entry: of the gradient, then of the Hessian
    std::vector<Offset> first_group{0};
    LargeArray<Index> neighbors;
    LargeArray<Scalar> weights;

    Index num_rows() const { return static_cast<Index>(first_group.size() - 1); }
    Offset begin(Offset row) const { return 4 * first_group[row]; }
    Offset end(Offset row) const { return 4 * first_group[row + 1]; }
    Offset place(Offset entry, int k) const { return 4 * (entry / 4 * width + k) + entry % 4; }
    Scalar weight(Offset entry, int k) const { return weights[place(entry, k)]; }
  };

  // A blend for the fast path. `stencils` then has rows of the active vertices' neighbours too, which follow them in
  // the numbering.
  struct Blend {
    Stencils averaging;
    std::vector<Scalar> edges, metrics, caution;  // kernels/blend_stage.hpp
  };

  // Points given by their weights: what a point reads of each vertex, a | (c_1 … c_d) | (q_11 …), and β apart.
  struct Weighted {
    std::vector<Offset> first{0};  // [point]
    std::vector<Index> nodes;
    std::vector<Scalar> coefficients, beta;

    Index num_points() const { return static_cast<Index>(first.size() - 1); }
  };
  // Numbers that a point reads of each vertex, β apart.
  int weighted_width() const {
    return 1 + (rule.needs_gradients() ? gdim : 0) + (rule.needs_hessians() ? num_symmetric(gdim) : 0);
  }

  InterpolationRule rule;
  BindReport report;
  int gdim = 0;
  Index num_active = 0;
  Index num_served = 0;         // points with a cell
  std::vector<Index> vertices;  // the mesh's number of each vertex: active ones first, then those that stencils read
  std::vector<AnyRuns> blocks;
  Weighted weighted;               // instead of blocks
  std::vector<Index> permutation;  // the caller's point at each sorted position, those not found last
  std::vector<Index> position;     // its inverse; empty where the orders are the same
  bool has_gradients = false;
  Stencils stencils;
  std::optional<Reconstruction> blended;  // of the plain path, where `stencils` are part of a blend
  Blend blend;

  void require_values(const Values<Scalar>& values) const {
    if (values.rows() != report.num_vertices)
      raise("values of {} vertices: the mesh has {}", values.rows(), report.num_vertices);
  }
  void require_gradients() const {
    if (!has_gradients)
      raise("this interpolant was bound without a reconstructor: give vertex gradients to evaluate_given");
  }

  // Calls body(runs, begin, end) on ranges of runs that hold some thousand points each. Ranges begin with a window.
  template <class Body>
  void for_each_range(Body&& body) const {
    for (const AnyRuns& any : blocks)
      std::visit(
          [&](const auto& runs) {
            constexpr Offset size = kernels::window_size;
            const Offset num_runs = runs.num_runs(), num_points = runs.num_points();
            const Offset num_windows = (num_runs + size - 1) / size;
            const Offset grain = num_points < parallel_threshold
                                     ? num_windows
                                     : std::max<Offset>(1, num_windows * points_per_task / num_points);
            parallel_for(num_windows, grain, [&](std::int64_t begin, std::int64_t end) {
              body(runs, static_cast<Index>(begin * size), static_cast<Index>(std::min(end * size, num_runs)));
            });
          },
          any);
  }

  // Bound of the quadratic correction over a cell: α (1 − 1/n)/2 · max |(F_i − F_j)(X_j − X_i)|, from writing the
  // correction as α Σ_{i<j} β_i β_j (F_i − F_j)(X_j − X_i); holds for points inside.
  template <Element E>
  double correction_bound(const Runs<E>& runs, Index run, const Values<Scalar>& gradients, Eigen::Index columns) const {
    double largest = 0;
    for (int i = 0; i < E::num_nodes; ++i)
      for (int j = 0; j < i; ++j) {
        double squared = 0;
        for (Eigen::Index c = 0; c < columns; ++c) {
          double component = 0;
          for (int k = 0; k < E::dim; ++k)
            component += static_cast<double>(gradients(runs.nodes[run][i], c * E::dim + k) -
                                             gradients(runs.nodes[run][j], c * E::dim + k)) *
                         static_cast<double>(runs.rest[run][j][k] - runs.rest[run][i][k]);
          squared += component * component;
        }
        if (std::isnan(squared)) return squared;
        largest = std::max(largest, squared);
      }
    return std::abs(rule.alpha) * (1 - 1.0 / E::num_nodes) / 2 * std::sqrt(largest);
  }
  // NaN gradients bound nothing, and a run with points outside is not bounded by its nodes.
  template <Element E>
  bool is_linear(const Runs<E>& runs, Index run, const Values<Scalar>& gradients, Eigen::Index columns,
                 double tolerance) const {
    // Elsewhere the test would cost more than it saves.
    if (!E::affine || !(tolerance > 0) || rule.formula != Formula::blend) return false;
    if (!runs.extrapolates.empty() && runs.extrapolates[run]) return false;
    return correction_bound(runs, run, gradients, columns) <= tolerance;
  }

  // The vertex stage.
  // The first `count` rows of values in the binding's numbering, padded to four columns with zeros.
  Scalar* pack_positions(const Values<Scalar>& values, Offset count, Workspace<Scalar>& workspace) const;
  static kernels::VertexStage<Scalar> vertex_stage(const Stencils& rows, const std::array<Scalar, 9>& scale,
                                                   const Scalar* positions, Scalar* lines) {
    return {rows.width, rows.first_group.data(), rows.neighbors.data(), rows.weights.data(), scale, positions, lines};
  }
  // Lines of the active vertices, of the blend where there is one; scale as in kernels::VertexStage.
  void vertex_lines(const Scalar* positions, const std::array<Scalar, 9>& scale, Workspace<Scalar>& workspace,
                    Scalar* lines) const;
  // F, and Q where the rule needs Hessians, of the active vertices.
  void vertex_derivatives(const Values<Scalar>& values, Kernel kernel, Workspace<Scalar>& workspace,
                          Values<Scalar>& gradients, Values<Scalar>& hessians) const;
  void plain_vertex_stage(const Values<Scalar>& values, int first_weight, int width, Values<Scalar>& out) const;

  // The plain path.
  template <int fixed_columns, class E>
  void plain_point_stage(const Runs<E>& runs, Index begin, Index end, const Values<Scalar>& values,
                         const Values<Scalar>& gradients, const Values<Scalar>& hessians, double tolerance,
                         Scalar* out) const;

  void weighted_point_stage(int columns, const Scalar* lines, Scalar* out) const;
  void plain_weighted_stage(const Values<Scalar>& values, const Values<Scalar>& gradients,
                            const Values<Scalar>& hessians, Scalar* out) const;
  // Adds β-weighted rows of vertex data (#active × #columns) to `out`.
  void add_weighted_means(const Values<Scalar>& vertex_data, Values<Scalar>& out) const;

  // The row of a point in the map as a matrix: one node's part.
  using Entries = std::vector<Eigen::Triplet<double>>;
  void add_entries(Index point, Index node, double a, const double* c, const double* q, Entries& entries) const;
  void add_weighted_entries(Entries& entries) const;

  // The end of bind: the rows of the active vertices, and sums for the report. `number` is the binding's number of each
  // of the caller's vertices, −1 where it has none yet.
  void take_gradients(const Reconstruction* reconstruction, std::vector<Index>& number);
  void take_blend(std::vector<Index>& number);
  void count_bytes();

  // Both stages into `out`, #points × #columns in sorted order. Gradients come from the stencils where null.
  void frame(const Values<Scalar>& values, const Values<Scalar>* gradients, const Values<Scalar>* hessians,
             const EvaluateOptions& options, Workspace<Scalar>& workspace, Scalar* out) const;
  void to_caller_order(const Values<Scalar>& sorted, Values<Scalar>& out) const;
  // Whether every cell goes the fast path alone.
  bool all_fast(Eigen::Index columns, Kernel kernel) const;
  // The cells that changed since the workspace's last frame; their number.
  Index update(const Values<Scalar>& values, const EvaluateOptions& options, Workspace<Scalar>& workspace,
               Scalar* out) const;
};

}  // namespace halfgrad
