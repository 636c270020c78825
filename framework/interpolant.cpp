#include "framework/interpolant.hpp"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>

#include "framework/error.hpp"
#include "framework/kernels/formulas.hpp"
#include "framework/parallel.hpp"

namespace halfgrad {

namespace {

// Points a task; below the threshold a frame is too short to wake a second thread for.
constexpr Offset points_per_task = 8192;
constexpr Offset parallel_threshold = 200'000;

// Interleaves the bits of quantised coordinates: cells near in space get near numbers.
std::uint64_t morton_code(const Vector& unit) {
  const int gdim = static_cast<int>(unit.size());
  const int bits = std::min(21, 63 / gdim);
  std::uint64_t code = 0;
  std::array<std::uint64_t, 8> coordinate{};
  for (int k = 0; k < gdim; ++k)
    coordinate[k] = static_cast<std::uint64_t>(std::clamp(unit[k], 0.0, 1.0) * static_cast<double>((1ull << bits) - 1));
  for (int b = bits - 1; b >= 0; --b)
    for (int k = 0; k < gdim; ++k) code = (code << 1) | ((coordinate[k] >> b) & 1);
  return code;
}

// The cells that hold points, sorted along a space-filling curve, and the points of each in ascending order.
struct CellOrder {
  std::vector<Index> cells;
  std::vector<Index> first_point;  // #cells + 1, into points
  std::vector<Index> points;
};

CellOrder order_cells(const Mesh& mesh, const Embedding& embedding) {
  std::vector<Index> count(static_cast<std::size_t>(mesh.num_cells()), 0);
  for (Index cell : embedding.cells)
    if (cell >= 0) ++count[cell];
  struct Keyed {
    std::uint64_t code;
    Index cell;
    bool operator<(const Keyed& other) const { return code != other.code ? code < other.code : cell < other.cell; }
  };
  const auto corner = [&](Index cell) { return Vector(mesh.vertices().row(mesh.cell_vertices(cell)[0]).transpose()); };
  Vector low, high;
  if (mesh.num_vertices() > 0) {
    low = mesh.vertices().colwise().minCoeff().transpose();
    high = mesh.vertices().colwise().maxCoeff().transpose();
  }
  const double extent = mesh.num_vertices() > 0 ? (high - low).maxCoeff() : 0;
  const double scale = extent > 0 ? 1 / extent : 0;
  std::vector<Keyed> keyed;
  for (Index cell = 0; cell < mesh.num_cells(); ++cell)
    if (count[cell] > 0) keyed.push_back({morton_code((corner(cell) - low) * scale), cell});
  std::sort(keyed.begin(), keyed.end());

  CellOrder order;
  order.first_point.push_back(0);
  std::vector<Index> next(count.size(), 0);
  for (const Keyed& key : keyed) {
    next[key.cell] = order.first_point.back();
    order.cells.push_back(key.cell);
    order.first_point.push_back(order.first_point.back() + count[key.cell]);
  }
  order.points.resize(static_cast<std::size_t>(order.first_point.back()));
  for (Index p = 0; p < embedding.num_points(); ++p)
    if (embedding.cells[p] >= 0) order.points[next[embedding.cells[p]]++] = p;
  return order;
}

std::vector<Index> vertices_by_first_use(const Mesh& mesh, const CellOrder& order) {
  std::vector<char> seen(static_cast<std::size_t>(mesh.num_vertices()), 0);
  std::vector<Index> active;
  for (Index cell : order.cells)
    for (Index v : mesh.cell_vertices(cell))
      if (!seen[v]) {
        seen[v] = 1;
        active.push_back(v);
      }
  return active;
}

}  // namespace

std::vector<Index> active_vertices(const Mesh& mesh, const Embedding& embedding) {
  return vertices_by_first_use(mesh, order_cells(mesh, embedding));
}

template <class Scalar>
struct Interpolant<Scalar>::Binding {
  // The cells of one element type that hold points: one run of points a cell.
  //   nodes    [run][node]        binding number of the vertex
  //   rest     [run][node][axis]  rest position relative to the run's first node
  //   first    [run]              position of the run's first point in `user` and `local`
  //   local    [point][axis]      ξ
  //   offset   [point]            row of `offsets` for points outside, else −1 (empty when no point is outside)
  template <class E>
  struct Runs {
    using element = E;
    std::vector<std::array<Index, E::num_nodes>> nodes;
    std::vector<std::array<std::array<Scalar, E::dim>, E::num_nodes>> rest;
    std::vector<Index> first{0};
    std::vector<Index> user;
    std::vector<std::array<Scalar, E::dim>> local;
    std::vector<Index> offset;
    std::vector<std::array<Scalar, E::dim>> offsets;

    Index num_runs() const { return static_cast<Index>(nodes.size()); }
  };
  using AnyRuns = Elements::apply<std::variant, Runs>;

  InterpolationRule rule;
  BindReport report;
  int gdim = 0;
  std::vector<Index> active;
  std::vector<AnyRuns> blocks;
  std::vector<Index> unserved;  // points not found
  bool has_gradients = false;
  Reconstruction reconstruction;  // rows in binding order; the table's weights serve matrix(), their copies the frames
  std::vector<Scalar> weights, hessian_weights;

  // Weights of one point, and their derivatives along the reference axes where asked for.
  template <Element E>
  static NodeVector<E> beta(const Runs<E>& runs, Index p) {
    ReferencePoint<E> xi;
    for (int k = 0; k < E::dim; ++k) xi[k] = runs.local[p][k];
    NodeVector<E> beta = E::shape(xi);
    if (!runs.offset.empty() && runs.offset[p] >= 0) {
      const NodeMatrix<E> gradient = E::shape_gradient(xi);
      for (int k = 0; k < E::dim; ++k) beta += gradient.col(k) * static_cast<double>(runs.offsets[runs.offset[p]][k]);
    }
    return beta;
  }

  void require_values(const Values<Scalar>& values) const {
    if (values.rows() != report.num_vertices)
      raise("values of {} vertices: the mesh has {}", values.rows(), report.num_vertices);
  }
  void require_gradients() const {
    if (!has_gradients)
      raise("this interpolant was bound without a reconstructor: give vertex gradients to evaluate_given");
  }

  void vertex_stage(const Values<Scalar>& values, const std::vector<Scalar>& row_weights, int width,
                    Values<Scalar>& out) const;
  template <int columns>
  void point_stage(const Values<Scalar>& values, const Values<Scalar>& gradients, const Values<Scalar>& hessians,
                   double tolerance, Values<Scalar>& out) const;

  // Calls body(runs, begin, end) on ranges of runs that hold some thousand points each.
  template <class Body>
  void for_each_range(Body&& body) const {
    for (const AnyRuns& any : blocks)
      std::visit(
          [&](const auto& runs) {
            const Offset num_runs = runs.num_runs();
            const Offset num_points = runs.first.back();
            const Offset grain = num_points < parallel_threshold
                                     ? num_runs
                                     : std::max<Offset>(1, num_runs * points_per_task / num_points);
            parallel_for(num_runs, grain, [&](std::int64_t begin, std::int64_t end) {
              body(runs, static_cast<Index>(begin), static_cast<Index>(end));
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
        largest = std::max(largest, squared);
      }
    return std::abs(rule.alpha) * (1 - 1.0 / E::num_nodes) / 2 * std::sqrt(largest);
  }
  // NaN gradients bound nothing, and a run with points outside is not bounded by its nodes.
  template <Element E>
  bool is_linear(const Runs<E>& runs, Index run, const Values<Scalar>& gradients, Eigen::Index columns,
                 double tolerance) const {
    if (!(tolerance > 0) || rule.formula != Formula::blend) return false;
    if (!runs.offset.empty())
      for (Index p = runs.first[run]; p < runs.first[run + 1]; ++p)
        if (runs.offset[p] >= 0) return false;
    return correction_bound(runs, run, gradients, columns) <= tolerance;
  }
};

template <class Scalar>
Interpolant<Scalar>::Interpolant(const Mesh& mesh, const Embedding& embedding, const InterpolationRule& rule,
                                 const Reconstruction* reconstruction) {
  if (embedding.gdim != mesh.gdim())
    raise("points embedded in {} dimensions, but the mesh has {}", embedding.gdim, mesh.gdim());
  auto binding = std::make_unique<Binding>();
  binding->rule = rule;
  binding->gdim = mesh.gdim();
  const CellOrder order = order_cells(mesh, embedding);
  binding->active = vertices_by_first_use(mesh, order);

  std::vector<Index> number(static_cast<std::size_t>(mesh.num_vertices()), -1);
  for (std::size_t a = 0; a < binding->active.size(); ++a) number[binding->active[a]] = static_cast<Index>(a);
  std::vector<Index> outside_row(embedding.outside.empty() ? 0 : embedding.cells.size(), -1);
  for (std::size_t o = 0; o < embedding.outside.size(); ++o)
    if (embedding.status[embedding.outside[o].point] == PointStatus::outside)
      outside_row[embedding.outside[o].point] = static_cast<Index>(o);

  Elements::for_each([&]<class E>() {
    typename Binding::template Runs<E> runs;
    for (std::size_t c = 0; c < order.cells.size(); ++c) {
      const auto* block = std::get_if<ElementBlock<E>>(&mesh.blocks()[mesh.block_of(order.cells[c])]);
      if (block == nullptr) continue;
      if (rule.formula == Formula::quadratic10 && !E::affine)
        raise("quadratic10 is defined on simplices; cell {} is a {}", order.cells[c], E::name);
      const auto positions =
          node_positions(mesh, *block, order.cells[c] - mesh.first_cell(mesh.block_of(order.cells[c])));
      auto& nodes = runs.nodes.emplace_back();
      auto& rest = runs.rest.emplace_back();
      const std::span<const Index> vertices = mesh.cell_vertices(order.cells[c]);
      for (int i = 0; i < E::num_nodes; ++i) {
        nodes[i] = number[vertices[i]];
        for (int k = 0; k < E::dim; ++k) rest[i][k] = static_cast<Scalar>(positions(i, k) - positions(0, k));
      }
      for (Index s = order.first_point[c]; s < order.first_point[c + 1]; ++s) {
        const Index p = order.points[s];
        runs.user.push_back(p);
        auto& local = runs.local.emplace_back();
        for (int k = 0; k < E::dim; ++k) local[k] = static_cast<Scalar>(embedding.local(p, k));
        if (!outside_row.empty()) {
          runs.offset.push_back(-1);
          if (outside_row[p] >= 0) {
            runs.offset.back() = static_cast<Index>(runs.offsets.size());
            auto& offset = runs.offsets.emplace_back();
            for (int k = 0; k < E::dim; ++k)
              offset[k] = static_cast<Scalar>(embedding.outside[outside_row[p]].offset[k]);
          }
        }
      }
      runs.first.push_back(static_cast<Index>(runs.user.size()));
    }
    if (runs.num_runs() > 0) binding->blocks.emplace_back(std::move(runs));
  });

  BindReport& report = binding->report;
  report.num_points = embedding.num_points();
  for (Index p = 0; p < embedding.num_points(); ++p) {
    switch (embedding.status[p]) {
      case PointStatus::inside:
        ++report.num_inside;
        break;
      case PointStatus::boundary:
        ++report.num_boundary;
        break;
      case PointStatus::outside:
        ++report.num_outside;
        break;
      case PointStatus::not_found:
        ++report.num_not_found;
        break;
    }
    if (embedding.cells[p] < 0) binding->unserved.push_back(p);
  }
  for (const OutsidePoint& outside : embedding.outside)
    report.max_outside_distance = std::max(report.max_outside_distance, outside.distance);
  report.num_cells = mesh.num_cells();
  report.num_active_cells = static_cast<Index>(order.cells.size());
  report.num_vertices = mesh.num_vertices();
  report.num_active_vertices = static_cast<Index>(binding->active.size());

  // α = 0 takes no gradients even where they are offered.
  if (rule.needs_gradients() && reconstruction != nullptr) {
    const GradientStencilTable& table = reconstruction->stencils;
    if (table.gdim != mesh.gdim()) raise("stencils of dimension {} for a mesh of {}", table.gdim, mesh.gdim());
    if (rule.needs_hessians() && !table.has_hessians() && table.num_rows() > 0)
      raise("dual_taylor needs vertex Hessians: use the reconstructor kriging with \"drift\": \"cubic\"");
    binding->has_gradients = true;
    binding->reconstruction = select_rows(*reconstruction, binding->active);
    const GradientStencilTable& own = binding->reconstruction.stencils;
    report.num_stencil_entries = own.num_entries();
    if (!rule.needs_hessians()) binding->reconstruction.stencils.hessian_weights.clear();
    binding->weights.assign(own.weights.begin(), own.weights.end());
    binding->hessian_weights.assign(own.hessian_weights.begin(), own.hessian_weights.end());
  }
  const auto bytes = [](const auto& vector) { return static_cast<Offset>(vector.size() * sizeof(vector[0])); };
  for (const auto& any : binding->blocks)
    std::visit(
        [&](const auto& runs) {
          report.bytes += bytes(runs.nodes) + bytes(runs.rest) + bytes(runs.first) + bytes(runs.user) +
                          bytes(runs.local) + bytes(runs.offset) + bytes(runs.offsets);
        },
        any);
  const GradientStencilTable& own = binding->reconstruction.stencils;
  report.bytes += bytes(binding->active) + bytes(binding->weights) + bytes(binding->hessian_weights) +
                  bytes(own.weights) + bytes(own.hessian_weights) + bytes(own.neighbors) + bytes(own.offsets);
  binding_ = std::move(binding);
}

template <class Scalar>
Interpolant<Scalar>::~Interpolant() = default;
template <class Scalar>
Interpolant<Scalar>::Interpolant(Interpolant&&) noexcept = default;
template <class Scalar>
Interpolant<Scalar>& Interpolant<Scalar>::operator=(Interpolant&&) noexcept = default;

template <class Scalar>
Index Interpolant<Scalar>::num_points() const {
  return binding_->report.num_points;
}
template <class Scalar>
Index Interpolant<Scalar>::num_vertices() const {
  return binding_->report.num_vertices;
}
template <class Scalar>
int Interpolant<Scalar>::gdim() const {
  return binding_->gdim;
}
template <class Scalar>
const InterpolationRule& Interpolant<Scalar>::rule() const {
  return binding_->rule;
}
template <class Scalar>
const BindReport& Interpolant<Scalar>::report() const {
  return binding_->report;
}
template <class Scalar>
std::span<const Index> Interpolant<Scalar>::active() const {
  return binding_->active;
}

template <class Scalar>
void Interpolant<Scalar>::Binding::vertex_stage(const Values<Scalar>& values, const std::vector<Scalar>& row_weights,
                                                int width, Values<Scalar>& out) const {
  const GradientStencilTable& table = reconstruction.stencils;
  const Eigen::Index columns = values.cols();
  out.resize(static_cast<Eigen::Index>(active.size()), columns * width);
  const Offset num_rows = static_cast<Offset>(active.size());
  parallel_for(num_rows, num_rows < 20'000 ? num_rows : 2048, [&](std::int64_t begin, std::int64_t end) {
    for (std::int64_t r = begin; r < end; ++r) {
      Scalar* row = out.data() + r * columns * width;
      std::fill(row, row + columns * width, Scalar(0));
      const Scalar* own = values.data() + static_cast<Offset>(active[r]) * columns;
      for (Offset e = table.offsets[r]; e < table.offsets[r + 1]; ++e) {
        const Scalar* other = values.data() + static_cast<Offset>(table.neighbors[e]) * columns;
        const Scalar* weight = row_weights.data() + e * width;
        for (Eigen::Index c = 0; c < columns; ++c) {
          const Scalar difference = other[c] - own[c];
          for (int k = 0; k < width; ++k) row[c * width + k] += difference * weight[k];
        }
      }
    }
  });
}

template <class Scalar>
template <int fixed_columns>
void Interpolant<Scalar>::Binding::point_stage(const Values<Scalar>& values, const Values<Scalar>& gradients,
                                               const Values<Scalar>& hessians, double tolerance,
                                               Values<Scalar>& out) const {
  const int columns = fixed_columns > 0 ? fixed_columns : static_cast<int>(values.cols());
  InterpolationRule linear;
  linear.alpha = 0;
  for_each_range([&]<class AnyElementRuns>(const AnyElementRuns& runs, Index begin, Index end) {
    using E = typename AnyElementRuns::element;
    constexpr int n = E::num_nodes, d = E::dim, sym = num_symmetric(d);
    for (Index run = begin; run < end; ++run) {
      const bool flat = rule.needs_gradients() && is_linear<E>(runs, run, gradients, columns, tolerance);
      const InterpolationRule& used = flat ? linear : rule;
      const bool with_gradients = used.needs_gradients();
      const bool with_hessians = used.needs_hessians();
      std::array<const Scalar*, n> x, gradient{}, hessian{};
      for (int i = 0; i < n; ++i) {
        const Offset node = runs.nodes[run][i];
        x[i] = values.data() + static_cast<Offset>(active[node]) * columns;
        if (with_gradients) gradient[i] = gradients.data() + node * columns * d;
        if (with_hessians) hessian[i] = hessians.data() + node * columns * sym;
      }
      for (Index p = runs.first[run]; p < runs.first[run + 1]; ++p) {
        const NodeVector<E> weights_of_point = beta<E>(runs, p);
        std::array<Scalar, n> b;
        for (int i = 0; i < n; ++i) b[i] = static_cast<Scalar>(weights_of_point[i]);
        const auto coefficients = kernels::point_coefficients<Scalar, Scalar, n, d>(used, b, runs.rest[run]);
        Scalar* result = out.data() + static_cast<Offset>(runs.user[p]) * columns;
        for (int c = 0; c < columns; ++c) {
          // Differences to the first node: the digits of values far from zero stay out of the sum.
          Scalar sum = 0;
          for (int i = 1; i < n; ++i) sum += coefficients.a[i] * (x[i][c] - x[0][c]);
          if (with_gradients)
            for (int i = 0; i < n; ++i)
              for (int k = 0; k < d; ++k) sum += gradient[i][c * d + k] * coefficients.c[i][k];
          if (with_hessians)
            for (int i = 0; i < n; ++i)
              for (int k = 0; k < sym; ++k) sum += hessian[i][c * sym + k] * coefficients.q[i][k];
          result[c] = x[0][c] + sum;
        }
      }
    }
  });
  for (Index p : unserved)
    for (int c = 0; c < columns; ++c) out(p, c) = std::numeric_limits<Scalar>::quiet_NaN();
}

template <class Scalar>
void Interpolant<Scalar>::evaluate_given(const Values<Scalar>& values, const Values<Scalar>& gradients,
                                         const Values<Scalar>& hessians, Values<Scalar>& out,
                                         const EvaluateOptions& options) const {
  const Binding& binding = *binding_;
  binding.require_values(values);
  const Eigen::Index num_active = static_cast<Eigen::Index>(binding.active.size());
  const auto require = [&](const Values<Scalar>& given, Eigen::Index columns, const char* what) {
    if (given.rows() != num_active || given.cols() != columns)
      raise("{} of {} × {}: expected {} active vertices × {}", what, given.rows(), given.cols(), num_active, columns);
  };
  if (binding.rule.needs_gradients()) require(gradients, values.cols() * binding.gdim, "gradients");
  if (binding.rule.needs_hessians()) require(hessians, values.cols() * num_symmetric(binding.gdim), "hessians");
  out.resize(num_points(), values.cols());
  switch (values.cols()) {
    case 1:
      return binding.template point_stage<1>(values, gradients, hessians, options.tolerance, out);
    case 2:
      return binding.template point_stage<2>(values, gradients, hessians, options.tolerance, out);
    case 3:
      return binding.template point_stage<3>(values, gradients, hessians, options.tolerance, out);
    default:
      return binding.template point_stage<-1>(values, gradients, hessians, options.tolerance, out);
  }
}

template <class Scalar>
void Interpolant<Scalar>::evaluate(const Values<Scalar>& values, Values<Scalar>& out, Workspace<Scalar>& workspace,
                                   const EvaluateOptions& options) const {
  const Binding& binding = *binding_;
  binding.require_values(values);
  if (binding.rule.needs_gradients()) {
    binding.require_gradients();
    if (binding.reconstruction.blend)
      workspace.gradients = blended_gradients(binding.reconstruction, values);
    else
      binding.vertex_stage(values, binding.weights, binding.gdim, workspace.gradients);
    if (binding.rule.needs_hessians())
      binding.vertex_stage(values, binding.hessian_weights, num_symmetric(binding.gdim), workspace.hessians);
  }
  evaluate_given(values, workspace.gradients, workspace.hessians, out, options);
}

template <class Scalar>
Values<Scalar> Interpolant<Scalar>::evaluate(const Values<Scalar>& values, const EvaluateOptions& options) const {
  Values<Scalar> out;
  Workspace<Scalar> workspace;
  evaluate(values, out, workspace, options);
  return out;
}

template <class Scalar>
Values<Scalar> Interpolant<Scalar>::vertex_gradients(const Values<Scalar>& values) const {
  binding_->require_values(values);
  binding_->require_gradients();
  if (binding_->reconstruction.blend) return blended_gradients(binding_->reconstruction, values);
  Values<Scalar> gradients;
  binding_->vertex_stage(values, binding_->weights, binding_->gdim, gradients);
  return gradients;
}

template <class Scalar>
Values<Scalar> Interpolant<Scalar>::vertex_hessians(const Values<Scalar>& values) const {
  binding_->require_values(values);
  binding_->require_gradients();
  if (binding_->hessian_weights.empty() && !binding_->active.empty())
    raise("this interpolant keeps no vertex Hessians: only dual_taylor does");
  Values<Scalar> hessians;
  binding_->vertex_stage(values, binding_->hessian_weights, num_symmetric(binding_->gdim), hessians);
  return hessians;
}

template <class Scalar>
Values<Scalar> Interpolant<Scalar>::gradient(const Values<Scalar>& values) const {
  const Binding& binding = *binding_;
  binding.require_values(values);
  const bool with_gradients = binding.rule.needs_gradients();
  const bool with_hessians = binding.rule.needs_hessians();
  const Values<Scalar> gradients = with_gradients ? vertex_gradients(values) : Values<Scalar>();
  const Values<Scalar> hessians = with_hessians ? vertex_hessians(values) : Values<Scalar>();
  const Eigen::Index columns = values.cols();
  Values<Scalar> out =
      Values<Scalar>::Constant(num_points(), columns * binding.gdim, std::numeric_limits<Scalar>::quiet_NaN());
  binding.for_each_range([&]<class AnyElementRuns>(const AnyElementRuns& runs, Index begin, Index end) {
    using E = typename AnyElementRuns::element;
    constexpr int n = E::num_nodes, d = E::dim, sym = num_symmetric(d);
    for (Index run = begin; run < end; ++run)
      for (Index p = runs.first[run]; p < runs.first[run + 1]; ++p) {
        ReferencePoint<E> xi;
        for (int k = 0; k < d; ++k) xi[k] = runs.local[p][k];
        const NodeMatrix<E> reference = E::shape_gradient(xi);
        Eigen::Matrix<double, d, d> jacobian = Eigen::Matrix<double, d, d>::Zero();
        for (int i = 0; i < n; ++i)
          for (int k = 0; k < d; ++k) jacobian.row(k) += static_cast<double>(runs.rest[run][i][k]) * reference.row(i);
        const NodeVector<E> weights = Binding::template beta<E>(runs, p);
        Scalar* result = out.data() + static_cast<Offset>(runs.user[p]) * columns * d;
        // Where the map of the cell folds to a point or a line (a hexahedron's collapsed corner) no gradient of the
        // weights exists; the continuous one does.
        double scale = 0;
        for (int i = 1; i < n; ++i) {
          double squared = 0;
          for (int k = 0; k < d; ++k) squared += static_cast<double>(runs.rest[run][i][k]) * runs.rest[run][i][k];
          scale = std::max(scale, std::sqrt(squared));
        }
        const bool singular = !(std::abs(jacobian.determinant()) > 1e-14 * std::pow(scale, d));
        if (singular) {
          for (Eigen::Index c = 0; c < columns * d; ++c) {
            Scalar sum = 0;
            if (with_gradients)
              for (int i = 0; i < n; ++i) sum += static_cast<Scalar>(weights[i]) * gradients(runs.nodes[run][i], c);
            result[c] = sum;
          }
          continue;
        }
        const NodeMatrix<E> spatial = reference * jacobian.inverse();
        std::array<kernels::Dual<Scalar, d>, n> beta;
        for (int i = 0; i < n; ++i) {
          beta[i].value = static_cast<Scalar>(weights[i]);
          for (int k = 0; k < d; ++k) beta[i].derivative[k] = static_cast<Scalar>(spatial(i, k));
        }
        const auto coefficients =
            kernels::point_coefficients<kernels::Dual<Scalar, d>, Scalar, n, d>(binding.rule, beta, runs.rest[run]);
        const auto& nodes = runs.nodes[run];
        for (Eigen::Index c = 0; c < columns; ++c)
          for (int k = 0; k < d; ++k) {
            Scalar sum = 0;
            for (int i = 1; i < n; ++i)
              sum += coefficients.a[i].derivative[k] *
                     (values(binding.active[nodes[i]], c) - values(binding.active[nodes[0]], c));
            if (with_gradients)
              for (int i = 0; i < n; ++i)
                for (int l = 0; l < d; ++l) sum += gradients(nodes[i], c * d + l) * coefficients.c[i][l].derivative[k];
            if (with_hessians)
              for (int i = 0; i < n; ++i)
                for (int l = 0; l < sym; ++l)
                  sum += hessians(nodes[i], c * sym + l) * coefficients.q[i][l].derivative[k];
            result[c * d + k] = sum;
          }
      }
  });
  return out;
}

template <class Scalar>
Values<Scalar> Interpolant<Scalar>::smooth_gradient(const Values<Scalar>& values) const {
  const Binding& binding = *binding_;
  const Values<Scalar> gradients = vertex_gradients(values);
  Values<Scalar> out =
      Values<Scalar>::Constant(num_points(), gradients.cols(), std::numeric_limits<Scalar>::quiet_NaN());
  binding.for_each_range([&]<class AnyElementRuns>(const AnyElementRuns& runs, Index begin, Index end) {
    using E = typename AnyElementRuns::element;
    for (Index run = begin; run < end; ++run)
      for (Index p = runs.first[run]; p < runs.first[run + 1]; ++p) {
        const NodeVector<E> weights = Binding::template beta<E>(runs, p);
        auto row = out.row(runs.user[p]);
        row.setZero();
        for (int i = 0; i < E::num_nodes; ++i)
          row += static_cast<Scalar>(weights[i]) * gradients.row(runs.nodes[run][i]);
      }
  });
  return out;
}

template <class Scalar>
Index Interpolant<Scalar>::num_linear_cells(const Values<Scalar>& values, const EvaluateOptions& options) const {
  if (!binding_->rule.needs_gradients()) return report().num_active_cells;
  const Values<Scalar> gradients = vertex_gradients(values);
  Index count = 0;
  for (const auto& any : binding_->blocks)
    std::visit(
        [&]<class AnyElementRuns>(const AnyElementRuns& runs) {
          using E = typename AnyElementRuns::element;
          for (Index run = 0; run < runs.num_runs(); ++run)
            count += binding_->template is_linear<E>(runs, run, gradients, values.cols(), options.tolerance);
        },
        any);
  return count;
}

template <class Scalar>
Eigen::SparseMatrix<double, Eigen::RowMajor> Interpolant<Scalar>::matrix() const {
  const Binding& binding = *binding_;
  if (binding.rule.needs_gradients()) binding.require_gradients();
  if (binding.reconstruction.blend) raise("adaptive gradients depend on the data: there is no matrix of the map");
  const GradientStencilTable& table = binding.reconstruction.stencils;
  std::vector<Eigen::Triplet<double>> entries;
  for (const auto& any : binding.blocks)
    std::visit(
        [&]<class AnyElementRuns>(const AnyElementRuns& runs) {
          using E = typename AnyElementRuns::element;
          constexpr int n = E::num_nodes, d = E::dim, sym = num_symmetric(d);
          for (Index run = 0; run < runs.num_runs(); ++run)
            for (Index p = runs.first[run]; p < runs.first[run + 1]; ++p) {
              const NodeVector<E> weights = Binding::template beta<E>(runs, p);
              std::array<double, n> beta;
              std::array<std::array<double, d>, n> rest;
              for (int i = 0; i < n; ++i) {
                beta[i] = weights[i];
                for (int k = 0; k < d; ++k) rest[i][k] = runs.rest[run][i][k];
              }
              const auto coefficients = kernels::point_coefficients<double, double, n, d>(binding.rule, beta, rest);
              for (int i = 0; i < n; ++i) {
                const Index node = runs.nodes[run][i];
                double own = coefficients.a[i];
                if (binding.rule.needs_gradients())
                  for (Offset e = table.offsets[node]; e < table.offsets[node + 1]; ++e) {
                    double weight = 0;
                    for (int k = 0; k < d; ++k) weight += coefficients.c[i][k] * table.weights[e * d + k];
                    if (binding.rule.needs_hessians())
                      for (int k = 0; k < sym; ++k) weight += coefficients.q[i][k] * table.hessian_weights[e * sym + k];
                    entries.emplace_back(runs.user[p], table.neighbors[e], weight);
                    own -= weight;
                  }
                entries.emplace_back(runs.user[p], binding.active[node], own);
              }
            }
        },
        any);
  Eigen::SparseMatrix<double, Eigen::RowMajor> matrix(num_points(), num_vertices());
  matrix.setFromTriplets(entries.begin(), entries.end());
  return matrix;
}

template class Interpolant<float>;
template class Interpolant<double>;

}  // namespace halfgrad
