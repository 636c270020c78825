// Bind: runs of points, the edges of their cells and the stencils of vertices, in the order of a binding.
#include <algorithm>
#include <numeric>

#include "framework/binding_order.hpp"
#include "framework/cell_map.hpp"
#include "framework/grid.hpp"
#include "framework/interpolant_binding.hpp"
#include "framework/large_array.hpp"

namespace halfgrad {

namespace {

// Sorted order and its inverse; the inverse is empty where both are the caller's order.
std::vector<Index> inverse_unless_identity(const std::vector<Index>& permutation) {
  std::vector<Index> inverse;
  if (std::is_sorted(permutation.begin(), permutation.end())) return inverse;
  inverse.resize(permutation.size());
  for (std::size_t s = 0; s < permutation.size(); ++s) inverse[permutation[s]] = static_cast<Index>(s);
  return inverse;
}

void count_points(const Embedding& embedding, BindReport& report) {
  report.num_points = embedding.num_points();
  std::array<Index, 4> count{};
  for (PointStatus status : embedding.status) ++count[static_cast<std::size_t>(status)];
  report.num_inside = count[static_cast<std::size_t>(PointStatus::inside)];
  report.num_boundary = count[static_cast<std::size_t>(PointStatus::boundary)];
  report.num_outside = count[static_cast<std::size_t>(PointStatus::outside)];
  report.num_not_found = count[static_cast<std::size_t>(PointStatus::not_found)];
  for (const OutsidePoint& outside : embedding.outside)
    report.max_outside_distance = std::max(report.max_outside_distance, outside.distance);
}

// Row of embedding.outside of each point that is outside and served, else −1; empty where no point is outside.
std::vector<Index> outside_rows(const Embedding& embedding) {
  std::vector<Index> row;
  for (std::size_t o = 0; o < embedding.outside.size(); ++o) {
    const Index point = embedding.outside[o].point;
    if (embedding.status[point] != PointStatus::outside) continue;
    if (row.empty()) row.assign(embedding.cells.size(), -1);
    row[point] = static_cast<Index>(o);
  }
  return row;
}

// Whether x(ξ) is affine on a cell, but for rounding: of its monomials only those of degree one move the cell's nodes,
// given relative to the first (num_nodes × dim). `magnitude` is that of the coordinates, whose own rounding counts.
template <class Scalar, PolynomialElement E>
bool has_affine_map(const NodeMatrix<E>& nodes, double magnitude) {
  const double extent = nodes.cwiseAbs().maxCoeff();
  const double rounding =
      2 * std::numeric_limits<Scalar>::epsilon() * extent + 8 * std::numeric_limits<double>::epsilon() * magnitude;
  for (std::size_t m = 0; m < E::shape_monomials.size(); ++m) {
    if (std::accumulate(E::shape_monomials[m].begin(), E::shape_monomials[m].end(), 0) <= 1) continue;
    ReferencePoint<E> sum = ReferencePoint<E>::Zero();
    for (int i = 0; i < E::num_nodes; ++i) sum += E::shape_coefficients[m][i] * nodes.row(i).transpose();
    if (!(sum.cwiseAbs().maxCoeff() <= rounding)) return false;
  }
  return true;
}

// Fills the runs of one element type from the cells `members` (places in order.cells); sizes are exact.
template <class Runs, class Scalar>
void pack_runs(const Mesh& mesh, const Embedding& embedding, const BindingOrder& order, std::span<const Index> members,
               std::span<const Index> number, std::span<const Index> outside_row, Runs& runs, Index* permutation) {
  using E = typename Runs::element;
  constexpr int n = E::num_nodes, d = E::dim;
  const auto num_runs = members.size();
  runs.nodes = LargeArray<std::array<Index, n>>(num_runs);
  runs.rest = LargeArray<std::array<std::array<Scalar, d>, n>>(num_runs + 1);
  runs.rest[num_runs] = {};
  runs.first.resize(num_runs + 1);
  for (std::size_t r = 0; r < num_runs; ++r)
    runs.first[r + 1] = runs.first[r] + order.first_point[members[r] + 1] - order.first_point[members[r]];
  const auto num_points = static_cast<std::size_t>(runs.first.back());
  runs.local.assign(num_points * d + kernels::vector_padding, Scalar(0));
  if constexpr (PolynomialElement<E> && !E::affine) runs.affine.resize(num_runs);
  if (!outside_row.empty()) runs.extrapolates.assign(num_runs, 0);
  if (!outside_row.empty() && !E::affine) runs.offset.assign(num_points, -1);
  const auto nodes_of = [&](Index run) {
    const Index cell = order.cells[members[run]];
    const std::size_t b = mesh.block_of(cell);
    return std::get<ElementBlock<E>>(mesh.blocks()[b]).cells.data() + (cell - mesh.first_cell(b)) * Offset{n};
  };
  const Index* last_point = order.points.data() + order.points.size() - 1;
  parallel_for(static_cast<std::int64_t>(num_runs), 4096, [&](std::int64_t begin, std::int64_t end) {
    for (auto r = static_cast<Index>(begin); r < end; ++r) {
      // Cells and points lie anywhere in the caller's order: each would miss the cache.
      __builtin_prefetch(nodes_of(std::min(r + 16, static_cast<Index>(num_runs) - 1)));
      const Index* nodes = nodes_of(r);
      NodeMatrix<E> positions;
      for (int i = 0; i < n; ++i) {
        positions.row(i) = mesh.vertices().row(nodes[i]).template head<d>();
        runs.nodes[r][i] = number[nodes[i]];
        for (int k = 0; k < d; ++k) runs.rest[r][i][k] = static_cast<Scalar>(positions(i, k) - positions(0, k));
      }
      if constexpr (PolynomialElement<E> && !E::affine)
        runs.affine[r] = has_affine_map<Scalar, E>(from_first_node<E>(positions), positions.cwiseAbs().maxCoeff());
      const Index* points = order.points.data() + order.first_point[members[r]];
      for (Index p = runs.first[r]; p < runs.first[r + 1]; ++p, ++points) {
        __builtin_prefetch(embedding.local.data() + points[std::min<std::ptrdiff_t>(24, last_point - points)] * d);
        permutation[p] = *points;
        // On a simplex a point outside differs from one inside by its ξ alone; elsewhere it keeps its offset apart.
        const bool outside = !outside_row.empty() && outside_row[*points] >= 0;
        for (int k = 0; k < d; ++k) {
          double xi = embedding.local(*points, k);
          if (E::affine && outside) xi += embedding.outside[outside_row[*points]].offset[k];
          runs.local[static_cast<Offset>(p) * d + k] = static_cast<Scalar>(xi);
        }
        if (outside) runs.extrapolates[r] = 1;
      }
    }
  });
  for (std::size_t p = 0; p < runs.offset.size(); ++p) {
    if (outside_row[permutation[p]] < 0) continue;
    runs.offset[p] = static_cast<Index>(runs.offsets.size());
    auto& offset = runs.offsets.emplace_back();
    for (int k = 0; k < d; ++k)
      offset[k] = static_cast<Scalar>(embedding.outside[outside_row[permutation[p]]].offset[k]);
  }
}

// Rows of the first `num_active` of `vertices`; the vertices that only the rows read are appended to `vertices`.
template <class Scalar, class Stencils>
void pack_stencils(const GradientStencilTable& table, bool with_hessians, Index num_active,
                   std::vector<Index>& vertices, std::vector<Index>& number, Stencils& stencils) {
  std::vector<Index> row_of(number.size(), -1);
  for (Index r = 0; r < table.num_rows(); ++r) row_of[table.vertices[r]] = r;
  const int d = table.gdim, sym = with_hessians ? num_symmetric(d) : 0, width = d + sym;
  stencils.width = width;
  stencils.first_group.resize(static_cast<std::size_t>(num_active) + 1);
  for (Index v = 0; v < num_active; ++v) {
    const Index r = row_of[vertices[v]];
    if (r < 0) raise("no gradient stencil for vertex {}: reconstruct every active vertex", vertices[v]);
    stencils.first_group[v + 1] = stencils.first_group[v] + (table.offsets[r + 1] - table.offsets[r] + 3) / 4;
  }
  const auto num_entries = static_cast<std::size_t>(4 * stencils.first_group.back());
  stencils.neighbors = LargeArray<Index>(num_entries);
  stencils.weights = LargeArray<Scalar>(num_entries * static_cast<std::size_t>(width));
  for (Index v = 0; v < num_active; ++v) {
    const Index r = row_of[vertices[v]];
    Offset to = stencils.begin(v);
    for (Offset e = table.offsets[r]; e < table.offsets[r + 1]; ++e, ++to) {
      Index& neighbor = number[table.neighbors[e]];
      if (neighbor < 0) {
        neighbor = static_cast<Index>(vertices.size());
        vertices.push_back(table.neighbors[e]);
      }
      stencils.neighbors[to] = neighbor;
      for (int k = 0; k < d; ++k)
        stencils.weights[stencils.place(to, k)] = static_cast<Scalar>(table.weights[e * d + k]);
      for (int k = 0; k < sym; ++k)
        stencils.weights[stencils.place(to, d + k)] = static_cast<Scalar>(table.hessian_weights[e * sym + k]);
    }
    for (; to < stencils.end(v); ++to) {
      stencils.neighbors[to] = v;
      for (int k = 0; k < width; ++k) stencils.weights[stencils.place(to, k)] = 0;
    }
  }
}

}  // namespace

template <class Scalar>
void Interpolant<Scalar>::Binding::take_gradients(const Reconstruction* reconstruction, std::vector<Index>& number) {
  // α = 0 takes no gradients even where they are offered.
  if (!rule.needs_gradients() || reconstruction == nullptr) return;
  const GradientStencilTable& table = reconstruction->stencils;
  if (table.gdim != gdim) raise("stencils of dimension {} for a mesh of {}", table.gdim, gdim);
  if (rule.needs_hessians() && !table.has_hessians() && table.num_rows() > 0)
    raise("dual_taylor needs vertex Hessians: use the reconstructor {{\"kriging\": {{\"drift\": \"cubic\"}}}}");
  has_gradients = true;
  if (reconstruction->blend) {
    blended = select_rows(*reconstruction, vertices);
    take_blend(number);
  } else {
    pack_stencils<Scalar>(table, rule.needs_hessians(), num_active, vertices, number, stencils);
  }
  vertices.shrink_to_fit();
  report.num_stencil_entries += table.num_entries();
}

template <class Scalar>
void Interpolant<Scalar>::Binding::take_blend(std::vector<Index>& number) {
  // Quotients along edges, weighed by up to 1e6 (adaptive.cpp), must be numbers of the type.
  drop_short_edges(*blended->blend, 1e6 * static_cast<double>(std::numeric_limits<Scalar>::min()));
  const AdaptiveBlend& given = *blended->blend;
  const GradientStencilTable rows = fitted_rows(*blended);
  for (Index r = num_active; r < rows.num_rows(); ++r) {
    number[rows.vertices[r]] = static_cast<Index>(vertices.size());
    vertices.push_back(rows.vertices[r]);
  }
  pack_stencils<Scalar>(rows, false, rows.num_rows(), vertices, number, stencils);
  pack_stencils<Scalar>(given.averaging, false, num_active, vertices, number, blend.averaging);
  report.num_stencil_entries += given.beyond.num_entries() + given.averaging.num_entries();
  for (Index r = 0; r < num_active; ++r) {
    const std::vector<WeightedEdge> edges = weighted_edges(given, r, gdim);
    for (const WeightedEdge& edge : edges) {
      blend.edges.push_back(static_cast<Scalar>(2 * edge.per_length));
      for (int a = 0; a < gdim; ++a) blend.edges.push_back(static_cast<Scalar>(-edge.along[a]));
    }
    const EdgeMetric metric = edge_metric(edges, gdim);
    for (const SmallMatrix* matrix : {&metric.sum, &metric.damped_inverse})
      for (int a = 0; a < gdim; ++a)
        for (int c = a; c < gdim; ++c) blend.metrics.push_back(static_cast<Scalar>((*matrix)(a, c)));
    blend.caution.push_back(static_cast<Scalar>(given.caution[r]));
  }
}

template <class Scalar>
void Interpolant<Scalar>::Binding::count_bytes() {
  const auto bytes = [](const auto& array) {
    if constexpr (requires { array.capacity(); })
      return static_cast<Offset>(array.capacity() * sizeof(array[0]));
    else
      return static_cast<Offset>(array.size() * sizeof(array[0]));
  };
  for (const auto& any : blocks)
    std::visit(
        [&](const auto& runs) {
          report.bytes += bytes(runs.nodes) + bytes(runs.rest) + bytes(runs.first) + bytes(runs.affine) +
                          bytes(runs.local) + bytes(runs.offset) + bytes(runs.offsets) + bytes(runs.extrapolates) +
                          bytes(runs.edges.first) + bytes(runs.edges.ends) + bytes(runs.edges.vectors) +
                          bytes(runs.edges.of_run) + bytes(runs.edges.reversed);
        },
        any);
  report.bytes += bytes(weighted.first) + bytes(weighted.nodes) + bytes(weighted.coefficients) + bytes(weighted.beta);
  report.bytes += bytes(vertices) + bytes(permutation) + bytes(position);
  for (const Stencils* rows : {&stencils, &blend.averaging})
    report.bytes += bytes(rows->first_group) + bytes(rows->neighbors) + bytes(rows->weights);
  report.bytes += bytes(blend.edges) + bytes(blend.metrics) + bytes(blend.caution);
  if (blended)
    for (const GradientStencilTable* table : {&blended->stencils, &blended->blend->averaging, &blended->blend->beyond})
      report.bytes += bytes(table->offsets) + bytes(table->neighbors) + bytes(table->weights);
}

template <class Scalar>
Interpolant<Scalar>::Interpolant(const Mesh& mesh, const Embedding& embedding, const InterpolationRule& rule,
                                 const Reconstruction* reconstruction)
    : Interpolant(mesh, embedding, binding_order(mesh, embedding), rule, reconstruction) {}

template <class Scalar>
Interpolant<Scalar>::Interpolant(const Mesh& mesh, const Embedding& embedding, const BindingOrder& order,
                                 const InterpolationRule& rule, const Reconstruction* reconstruction)
    : Interpolant(mesh, embedding, order, rule, reconstruction, {}, mesh.num_vertices(), mesh.num_cells()) {}

template <class Scalar>
Interpolant<Scalar>::Interpolant(const Grid& grid, const Embedding& embedding, const InterpolationRule& rule,
                                 const Reconstruction* reconstruction) {
  if (embedding.gdim != grid.gdim())
    raise("points embedded in {} dimensions, but the grid has {}", embedding.gdim, grid.gdim());
  const GridPart part = active_part(grid, embedding);
  *this = Interpolant(part.mesh, part.embedding, binding_order(part.mesh, part.embedding), rule, reconstruction,
                      part.vertices, grid.num_vertices(), grid.num_cells());
}

template <class Scalar>
Interpolant<Scalar>::Interpolant(const Mesh& mesh, const Embedding& embedding, const BindingOrder& order,
                                 const InterpolationRule& rule, const Reconstruction* reconstruction,
                                 std::span<const Index> numbers, Index num_vertices, Index num_cells) {
  if (embedding.gdim != mesh.gdim())
    raise("points embedded in {} dimensions, but the mesh has {}", embedding.gdim, mesh.gdim());
  const auto num_in_cells = std::ranges::count_if(embedding.cells, [](Index cell) { return cell >= 0; });
  if (static_cast<std::ptrdiff_t>(order.points.size()) != num_in_cells)
    raise("a binding order of {} points for an embedding that has {} in cells", order.points.size(), num_in_cells);
  auto binding = std::make_unique<Binding>();
  binding->rule = rule;
  binding->gdim = mesh.gdim();
  binding->vertices = order.vertices;
  binding->num_active = static_cast<Index>(binding->vertices.size());
  std::vector<Index> number(static_cast<std::size_t>(num_vertices), -1), part_number;
  if (!numbers.empty()) part_number.assign(numbers.size(), -1);
  for (std::size_t a = 0; a < binding->vertices.size(); ++a) {
    Index& vertex = binding->vertices[a];
    if (!numbers.empty()) {
      part_number[vertex] = static_cast<Index>(a);
      vertex = numbers[vertex];
    }
    number[vertex] = static_cast<Index>(a);
  }

  const std::vector<Index> outside_row = outside_rows(embedding);
  binding->permutation.resize(embedding.cells.size());
  Index base = 0;
  Elements::for_each([&]<class E>() {
    const auto is_block = [](const AnyBlock& block) { return std::holds_alternative<ElementBlock<E>>(block); };
    if (std::none_of(mesh.blocks().begin(), mesh.blocks().end(), is_block)) return;
    std::vector<Index> members;
    for (std::size_t c = 0; c < order.cells.size(); ++c)
      if (is_block(mesh.blocks()[mesh.block_of(order.cells[c])])) members.push_back(static_cast<Index>(c));
    if (members.empty()) return;
    if (rule.formula == Formula::quadratic10 && !E::affine)
      raise("quadratic10 is defined on simplices; cell {} is a {}", order.cells[members[0]], E::name);
    using Runs = typename Binding::template Runs<E>;
    Runs runs;
    runs.base = base;
    pack_runs<Runs, Scalar>(mesh, embedding, order, members, numbers.empty() ? number : part_number, outside_row, runs,
                            binding->permutation.data() + base);
    if constexpr (E::affine)
      if (rule.needs_gradients() && !rule.needs_hessians())
        runs.edges = edge_windows<E::dim, Scalar>(runs.nodes, [&](Index node) {
          return mesh.vertices().row(order.vertices[node]).template head<E::dim>().transpose();
        });
    base += runs.num_points();
    binding->blocks.emplace_back(std::move(runs));
  });
  binding->num_served = base;
  for (Index p = 0; p < embedding.num_points(); ++p)
    if (embedding.cells[p] < 0) binding->permutation[base++] = p;
  binding->position = inverse_unless_identity(binding->permutation);

  BindReport& report = binding->report;
  count_points(embedding, report);
  report.num_cells = num_cells;
  report.num_active_cells = static_cast<Index>(order.cells.size());
  report.num_vertices = num_vertices;
  report.num_active_vertices = binding->num_active;

  binding->take_gradients(reconstruction, number);
  binding->count_bytes();
  binding_ = std::move(binding);
}

template Interpolant<float>::Interpolant(const Mesh&, const Embedding&, const InterpolationRule&,
                                         const Reconstruction*);
template Interpolant<double>::Interpolant(const Mesh&, const Embedding&, const InterpolationRule&,
                                          const Reconstruction*);
template Interpolant<float>::Interpolant(const Mesh&, const Embedding&, const BindingOrder&, const InterpolationRule&,
                                         const Reconstruction*);
template Interpolant<double>::Interpolant(const Mesh&, const Embedding&, const BindingOrder&, const InterpolationRule&,
                                          const Reconstruction*);
template Interpolant<float>::Interpolant(const Grid&, const Embedding&, const InterpolationRule&,
                                         const Reconstruction*);
template Interpolant<double>::Interpolant(const Grid&, const Embedding&, const InterpolationRule&,
                                          const Reconstruction*);
// The one that all end in.
template Interpolant<float>::Interpolant(const Mesh&, const Embedding&, const BindingOrder&, const InterpolationRule&,
                                         const Reconstruction*, std::span<const Index>, Index, Index);
template Interpolant<double>::Interpolant(const Mesh&, const Embedding&, const BindingOrder&, const InterpolationRule&,
                                          const Reconstruction*, std::span<const Index>, Index, Index);

// Weighted points are bound in a file of their own.
template void Interpolant<float>::Binding::take_gradients(const Reconstruction*, std::vector<Index>&);
template void Interpolant<double>::Binding::take_gradients(const Reconstruction*, std::vector<Index>&);
template void Interpolant<float>::Binding::count_bytes();
template void Interpolant<double>::Binding::count_bytes();

}  // namespace halfgrad
