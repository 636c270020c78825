// Points given by their weights: coefficients of the formula at bind, sums every frame.
#include "framework/interpolant_binding.hpp"
#include "framework/kernels/formulas.hpp"
#include "framework/kernels/weighted_stage.hpp"
#include "framework/weighted_points.hpp"

namespace halfgrad {

namespace {

// Coefficients of one point with at most max_nodes vertices; unused places have weight zero, and with it no part in any
// formula. Appends a | (c_1 … c_d) | (q_11 …) for each vertex.
template <int d, class Scalar>
void append_coefficients(const WeightedPoints& points, Index point, const InterpolationRule& rule,
                         std::vector<Scalar>& coefficients) {
  std::array<double, max_nodes> beta{};
  std::array<std::array<double, d>, max_nodes> rest{};
  const Offset begin = points.offsets[point], end = points.offsets[point + 1];
  for (Offset e = begin; e < end; ++e) {
    beta[e - begin] = points.weights[e];
    for (int k = 0; k < d; ++k) rest[e - begin][k] = -points.arms[e * d + k];
  }
  const auto found = kernels::point_coefficients<double, double, max_nodes, d>(rule, beta, rest);
  for (Offset i = 0; i < end - begin; ++i) {
    coefficients.push_back(static_cast<Scalar>(found.a[i]));
    if (rule.needs_gradients())
      for (int k = 0; k < d; ++k) coefficients.push_back(static_cast<Scalar>(found.c[i][k]));
    if (rule.needs_hessians())
      for (int k = 0; k < num_symmetric(d); ++k) coefficients.push_back(static_cast<Scalar>(found.q[i][k]));
  }
}

template <class Scalar>
void append_coefficients(const WeightedPoints& points, Index point, const InterpolationRule& rule,
                         std::vector<Scalar>& coefficients) {
  switch (points.gdim) {
    case 1:
      return append_coefficients<1>(points, point, rule, coefficients);
    case 2:
      return append_coefficients<2>(points, point, rule, coefficients);
    case 3:
      return append_coefficients<3>(points, point, rule, coefficients);
    default:
      return append_coefficients<max_gdim>(points, point, rule, coefficients);
  }
}

void check(const WeightedPoints& points, const InterpolationRule& rule) {
  if (points.gdim < 1 || points.gdim > max_gdim)
    raise("weighted points of dimension {}: expected 1 to {}", points.gdim, max_gdim);
  if (rule.formula == Formula::quadratic10)
    raise("quadratic10 is defined on simplices; points given by their weights have no element");
  const auto num_entries = static_cast<std::size_t>(points.offsets.back());
  if (points.vertices.size() != num_entries || points.weights.size() != num_entries ||
      points.arms.size() != num_entries * static_cast<std::size_t>(points.gdim))
    raise("weighted points with {} entries: found {} vertices, {} weights and {} arms, expected {} arms", num_entries,
          points.vertices.size(), points.weights.size(), points.arms.size(),
          num_entries * static_cast<std::size_t>(points.gdim));
  for (Index p = 0; p < points.num_points(); ++p) {
    const Offset begin = points.offsets[p], end = points.offsets[p + 1];
    if (end - begin > max_nodes) raise("point {} has weights on {} vertices: at most {}", p, end - begin, max_nodes);
    double sum = 0;
    for (Offset e = begin; e < end; ++e) {
      if (points.vertices[e] < 0 || points.vertices[e] >= points.num_vertices)
        raise("point {} has a weight on vertex {}: expected 0 to {}", p, points.vertices[e], points.num_vertices - 1);
      sum += points.weights[e];
    }
    if (end > begin && !(std::abs(sum - 1) < 1e-6)) raise("the weights of point {} sum to {}: expected 1", p, sum);
  }
}

}  // namespace

std::vector<Index> active_vertices(const WeightedPoints& points) {
  std::vector<char> seen(static_cast<std::size_t>(points.num_vertices), 0);
  std::vector<Index> active;
  for (Index v : points.vertices)
    if (!seen[v]) {
      seen[v] = 1;
      active.push_back(v);
    }
  return active;
}

template <class Scalar>
Interpolant<Scalar>::Interpolant(const WeightedPoints& points, const InterpolationRule& rule,
                                 const Reconstruction* reconstruction) {
  check(points, rule);
  auto binding = std::make_unique<Binding>();
  binding->rule = rule;
  binding->gdim = points.gdim;
  binding->vertices = active_vertices(points);
  binding->num_active = static_cast<Index>(binding->vertices.size());
  std::vector<Index> number(static_cast<std::size_t>(points.num_vertices), -1);
  for (Index a = 0; a < binding->num_active; ++a) number[binding->vertices[a]] = a;

  // Points not found go last, as everywhere.
  std::vector<Index> missing;
  auto& weighted = binding->weighted;
  for (Index p = 0; p < points.num_points(); ++p) {
    const Offset begin = points.offsets[p], end = points.offsets[p + 1];
    if (begin == end) {
      missing.push_back(p);
      continue;
    }
    binding->permutation.push_back(p);
    for (Offset e = begin; e < end; ++e) {
      weighted.nodes.push_back(number[points.vertices[e]]);
      weighted.beta.push_back(static_cast<Scalar>(points.weights[e]));
    }
    append_coefficients(points, p, rule, weighted.coefficients);
    weighted.first.push_back(static_cast<Offset>(weighted.nodes.size()));
  }
  binding->num_served = weighted.num_points();
  binding->permutation.insert(binding->permutation.end(), missing.begin(), missing.end());
  if (!std::is_sorted(binding->permutation.begin(), binding->permutation.end())) {
    binding->position.resize(binding->permutation.size());
    for (std::size_t s = 0; s < binding->permutation.size(); ++s)
      binding->position[binding->permutation[s]] = static_cast<Index>(s);
  }
  BindReport& report = binding->report;
  report.num_points = points.num_points();
  report.num_inside = binding->num_served;
  report.num_not_found = static_cast<Index>(missing.size());
  report.num_vertices = points.num_vertices;
  report.num_active_vertices = binding->num_active;
  binding->take_gradients(reconstruction, number);
  binding->count_bytes();
  binding_ = std::move(binding);
}

template <class Scalar>
void Interpolant<Scalar>::Binding::weighted_point_stage(int columns, const Scalar* lines, Scalar* out) const {
  const kernels::WeightedStage<Scalar> stage{.num_columns = columns,
                                             .num_fours = weighted_width(),
                                             .first = weighted.first.data(),
                                             .nodes = weighted.nodes.data(),
                                             .coefficients = weighted.coefficients.data(),
                                             .lines = lines,
                                             .out = out};
  const Offset num_points = weighted.num_points();
  parallel_for(
      num_points, num_points < parallel_threshold ? num_points : points_per_task,
      [&](std::int64_t begin, std::int64_t end) { stage.run(static_cast<Index>(begin), static_cast<Index>(end)); });
}

template <class Scalar>
void Interpolant<Scalar>::Binding::plain_weighted_stage(const Values<Scalar>& values, const Values<Scalar>& gradients,
                                                        const Values<Scalar>& hessians, Scalar* out) const {
  const Eigen::Index columns = values.cols();
  const int symmetric = rule.needs_hessians() ? num_symmetric(gdim) : 0, width = weighted_width();
  const bool with_gradients = rule.needs_gradients();
  const Offset num_points = weighted.num_points();
  parallel_for(num_points, num_points < parallel_threshold ? num_points : points_per_task,
               [&](std::int64_t begin, std::int64_t end) {
                 for (std::int64_t p = begin; p < end; ++p) {
                   const Scalar* origin = values.data() + vertices[weighted.nodes[weighted.first[p]]] * columns;
                   Scalar* row = out + p * columns;
                   std::copy_n(origin, columns, row);
                   for (Offset e = weighted.first[p]; e < weighted.first[p + 1]; ++e) {
                     const Index node = weighted.nodes[e];
                     const Scalar* x = values.data() + static_cast<Offset>(vertices[node]) * columns;
                     const Scalar* a = weighted.coefficients.data() + e * width;
                     for (Eigen::Index c = 0; c < columns; ++c) {
                       // Differences to the first vertex: the digits of values far from zero stay out of the sum.
                       Scalar sum = a[0] * (x[c] - origin[c]);
                       if (with_gradients)
                         for (int k = 0; k < gdim; ++k) sum += gradients(node, c * gdim + k) * a[1 + k];
                       for (int k = 0; k < symmetric; ++k) sum += hessians(node, c * symmetric + k) * a[1 + gdim + k];
                       row[c] += sum;
                     }
                   }
                 }
               });
}

template <class Scalar>
void Interpolant<Scalar>::Binding::add_weighted_means(const Values<Scalar>& vertex_data, Values<Scalar>& out) const {
  for (Index p = 0; p < weighted.num_points(); ++p) {
    auto row = out.row(permutation[p]);
    row.setZero();
    for (Offset e = weighted.first[p]; e < weighted.first[p + 1]; ++e)
      row += weighted.beta[e] * vertex_data.row(weighted.nodes[e]);
  }
}

template <class Scalar>
void Interpolant<Scalar>::Binding::add_weighted_entries(Entries& entries) const {
  const int width = weighted_width();
  for (Index p = 0; p < weighted.num_points(); ++p)
    for (Offset e = weighted.first[p]; e < weighted.first[p + 1]; ++e) {
      std::array<double, 1 + max_gdim + num_symmetric(max_gdim)> a{};
      std::copy_n(weighted.coefficients.data() + e * width, width, a.data());
      add_entries(permutation[p], weighted.nodes[e], a[0], a.data() + 1, a.data() + 1 + gdim, entries);
    }
}

template Interpolant<float>::Interpolant(const WeightedPoints&, const InterpolationRule&, const Reconstruction*);
template Interpolant<double>::Interpolant(const WeightedPoints&, const InterpolationRule&, const Reconstruction*);
template void Interpolant<float>::Binding::weighted_point_stage(int, const float*, float*) const;
template void Interpolant<double>::Binding::weighted_point_stage(int, const double*, double*) const;
template void Interpolant<float>::Binding::plain_weighted_stage(const Values<float>&, const Values<float>&,
                                                                const Values<float>&, float*) const;
template void Interpolant<double>::Binding::plain_weighted_stage(const Values<double>&, const Values<double>&,
                                                                 const Values<double>&, double*) const;
template void Interpolant<float>::Binding::add_weighted_means(const Values<float>&, Values<float>&) const;
template void Interpolant<double>::Binding::add_weighted_means(const Values<double>&, Values<double>&) const;
template void Interpolant<float>::Binding::add_weighted_entries(Entries&) const;
template void Interpolant<double>::Binding::add_weighted_entries(Entries&) const;

}  // namespace halfgrad
