#include "framework/scattered_transfer.hpp"

#include <Eigen/QR>
#include <algorithm>
#include <array>
#include <cmath>
#include <nanoflann.hpp>
#include <string>

#include "framework/error.hpp"
#include "framework/parallel.hpp"

namespace halfgrad {

namespace {

using Matrix = Eigen::SparseMatrix<double, Eigen::RowMajor>;
constexpr std::int64_t grain = 64;

/// Rows of a matrix as nanoflann reads them.
struct Cloud {
  const Points& points;
  const std::vector<Index>& rows;
  std::size_t kdtree_get_point_count() const { return rows.size(); }
  double kdtree_get_pt(std::size_t i, std::size_t axis) const {
    return points(rows[i], static_cast<Eigen::Index>(axis));
  }
  template <class Box>
  bool kdtree_get_bbox(Box&) const {
    return false;
  }
};
using Tree = nanoflann::KDTreeSingleIndexAdaptor<nanoflann::L2_Simple_Adaptor<double, Cloud>, Cloud, -1, std::size_t>;

/// A vertex near a point, with its kernel weight.
struct Neighbor {
  Index vertex;
  double weight;
};

/// The vertices with a positive kernel weight at a point, ascending by vertex.
std::vector<Neighbor> neighbors_of(const Tree& tree, const Cloud& cloud, const double* point, double radius,
                                   std::size_t least) {
  // The radius that gives `least` vertices a positive weight ends at the next one, or, where there is none, beyond the
  // last. It is continuous in the point, and so are the weights.
  const std::size_t asked = std::min(least + 1, cloud.rows.size());
  std::vector<std::size_t> nearest(asked);
  std::vector<double> squares(asked);
  tree.knnSearch(point, asked, nearest.data(), squares.data());
  const double square = std::max(radius * radius, asked > least ? squares.back() : 4 * squares.back());
  std::vector<std::pair<std::size_t, double>> found;
  tree.radiusSearch(point, square, found, nanoflann::SearchParams(0, 0, false));
  std::vector<Neighbor> neighbors;
  for (const auto& [number, distance] : found)
    if (const double rest = 1 - distance / square; rest > 0)
      neighbors.push_back({cloud.rows[number], rest * rest * rest});
  // Vertices at equal distances beyond the asked number can leave none: they share the weight then.
  if (neighbors.empty())
    for (const std::size_t number : nearest) neighbors.push_back({cloud.rows[number], 1});
  std::sort(neighbors.begin(), neighbors.end(),
            [](const Neighbor& a, const Neighbor& b) { return a.vertex < b.vertex; });
  return neighbors;
}

/// Turns kernel weights into those of the value at the point of the best quadratic. Where the neighbours determine no
/// quadratic, the solution of least norm is the value of the part that they do determine.
void fit_quadratic(const Points& rest, const Eigen::RowVectorXd& point, std::vector<Neighbor>& neighbors) {
  const Eigen::Index d = rest.cols(), count = static_cast<Eigen::Index>(neighbors.size());
  double scale = 0;
  for (const Neighbor& neighbor : neighbors) scale = std::max(scale, (rest.row(neighbor.vertex) - point).norm());
  if (scale == 0) scale = 1;
  Eigen::MatrixXd basis(count, 1 + d + num_symmetric(static_cast<int>(d)));
  Eigen::VectorXd root(count);
  for (Eigen::Index j = 0; j < count; ++j) {
    const Eigen::RowVectorXd offset = (rest.row(neighbors[j].vertex) - point) / scale;
    root[j] = std::sqrt(neighbors[j].weight);
    Eigen::Index column = 0;
    basis(j, column++) = 1;
    for (Eigen::Index a = 0; a < d; ++a) basis(j, column++) = offset[a];
    for (Eigen::Index a = 0; a < d; ++a)
      for (Eigen::Index b = a; b < d; ++b) basis(j, column++) = offset[a] * offset[b];
  }
  // value = e_0ᵀ (√W P)⁺ √W x.
  const Eigen::CompleteOrthogonalDecomposition<Eigen::MatrixXd> decomposition(root.asDiagonal() * basis);
  const Eigen::RowVectorXd first = decomposition.pseudoInverse().row(0);
  for (Eigen::Index j = 0; j < count; ++j) neighbors[j].weight = first[j] * root[j];
}

void normalise(std::vector<Neighbor>& neighbors) {
  double sum = 0;
  for (const Neighbor& neighbor : neighbors) sum += neighbor.weight;
  for (Neighbor& neighbor : neighbors) neighbor.weight /= sum;
}

/// Adds w_i F_i (X − X_i) to the weights of the rows.
Matrix with_gradients(const Matrix& weights, const Points& rest, const Points& points,
                      const GradientStencilTable& table) {
  std::vector<Index> row_of(rest.rows(), -1);
  for (Index row = 0; row < table.num_rows(); ++row) row_of[table.vertices[row]] = row;
  std::vector<Eigen::Triplet<double>> entries;
  for (Eigen::Index p = 0; p < weights.outerSize(); ++p)
    for (Matrix::InnerIterator entry(weights, p); entry; ++entry) {
      const auto vertex = static_cast<Index>(entry.col());
      const Index row = row_of[vertex];
      const Eigen::RowVectorXd offset = points.row(p) - rest.row(vertex);
      double own = entry.value();
      for (Offset e = table.offsets[row]; e < table.offsets[row + 1]; ++e) {
        double weight = 0;
        for (int k = 0; k < table.gdim; ++k) weight += offset[k] * table.weights[e * table.gdim + k];
        weight *= entry.value();
        entries.emplace_back(p, table.neighbors[e], weight);
        own -= weight;
      }
      entries.emplace_back(p, vertex, own);
    }
  Matrix result(weights.rows(), weights.cols());
  result.setFromTriplets(entries.begin(), entries.end());
  return result;
}

}  // namespace

std::span<const NamedScatteredRule> scattered_rules() {
  using Kind = ScatteredRule::Kind;
  static constexpr std::array rules = {
      NamedScatteredRule{"attribute_transfer",
                         {},
                         "baseline: kernel weights on the vertices within a radius, no cells; order one (two where "
                         "gradients are carried)"},
      NamedScatteredRule{
          "moving_least_squares",
          {.kind = Kind::moving_least_squares, .radius = 2.5, .neighbors = 20},
          "baseline: the quadratic that fits best to the vertices within a radius, a fit for each point"},
  };
  return rules;
}

std::optional<ScatteredRule> find_scattered_rule(std::string_view name) {
  for (const NamedScatteredRule& named : scattered_rules())
    if (named.name == name) return named.rule;
  return std::nullopt;
}

ScatteredTransfer::ScatteredTransfer(const Mesh& mesh, const Points& points, const ScatteredRule& rule,
                                     const VertexGradientReconstructor* reconstructor)
    : rest_(mesh.vertices()), points_(points), matrix_(points.rows(), mesh.num_vertices()) {
  if (!(rule.radius > 0 && std::isfinite(rule.radius)))
    raise("radius {}: expected a positive number of mean edge lengths", rule.radius);
  if (rule.neighbors < 1) raise("neighbors {}: expected at least 1", rule.neighbors);
  if (mesh.num_cells() == 0) raise("the mesh has no cells: there are no vertices to carry points");
  if (points.cols() != mesh.gdim())
    raise("points have {} coordinates, but the mesh is {}-dimensional", points.cols(), mesh.gdim());
  if (!points.allFinite()) raise("a point has a coordinate that is not finite");
  if (rule.needs_gradients() && reconstructor == nullptr)
    raise("attribute_transfer that carries gradients needs a reconstructor");

  // Vertices of no cell have no values that mean anything.
  std::vector<char> is_used(mesh.num_vertices(), 0);
  for (Index cell = 0; cell < mesh.num_cells(); ++cell)
    for (const Index vertex : mesh.cell_vertices(cell)) is_used[vertex] = 1;
  std::vector<Index> used;
  for (Index vertex = 0; vertex < mesh.num_vertices(); ++vertex)
    if (is_used[vertex]) used.push_back(vertex);
  const Cloud cloud{rest_, used};
  Tree tree(mesh.gdim(), cloud, nanoflann::KDTreeSingleIndexAdaptorParams(16));
  tree.buildIndex();

  const double radius = rule.radius * mean_edge_length(mesh);
  std::vector<std::vector<Neighbor>> rows(points.rows());
  parallel_for(points.rows(), grain, [&](std::int64_t begin, std::int64_t end) {
    for (std::int64_t p = begin; p < end; ++p) {
      rows[p] = neighbors_of(tree, cloud, points.row(p).data(), radius, static_cast<std::size_t>(rule.neighbors));
      if (rule.kind == ScatteredRule::Kind::moving_least_squares) fit_quadratic(rest_, points.row(p), rows[p]);
      normalise(rows[p]);
    }
  });
  Eigen::VectorXi sizes(points.rows());
  for (Eigen::Index p = 0; p < points.rows(); ++p) sizes[p] = static_cast<int>(rows[p].size());
  matrix_.reserve(sizes);
  for (Eigen::Index p = 0; p < points.rows(); ++p)
    for (const Neighbor& neighbor : rows[p]) matrix_.insert(p, neighbor.vertex) = neighbor.weight;
  matrix_.makeCompressed();

  if (!rule.needs_gradients()) return;
  std::fill(is_used.begin(), is_used.end(), 0);
  for (const std::vector<Neighbor>& row : rows)
    for (const Neighbor& neighbor : row) is_used[neighbor.vertex] = 1;
  std::erase_if(used, [&](Index vertex) { return is_used[vertex] == 0; });
  const Reconstruction reconstruction = reconstructor->reconstruct(CellGradients(mesh), used);
  if (reconstruction.blend) raise("attribute_transfer needs gradients that do not depend on the data: not adaptive");
  matrix_ = with_gradients(matrix_, rest_, points_, reconstruction.stencils);
}

ScatteredTransfer ScatteredTransfer::from_weights(const Mesh& mesh, const Points& points, Matrix weights) {
  if (weights.rows() != points.rows() || weights.cols() != mesh.num_vertices() || points.cols() != mesh.gdim())
    raise("weights of {} x {}, expected {} points by {} vertices", weights.rows(), weights.cols(), points.rows(),
          mesh.num_vertices());
  ScatteredTransfer transfer;
  transfer.rest_ = mesh.vertices();
  transfer.points_ = points;
  transfer.matrix_ = std::move(weights);
  return transfer;
}

template <class Scalar>
void ScatteredTransfer::apply(const Values<Scalar>& values, Eigen::Index num_positions, Values<Scalar>& out) const {
  if (values.rows() != rest_.rows()) raise("{} values for {} vertices", values.rows(), rest_.rows());
  out.resize(points_.rows(), values.cols());
  parallel_for(points_.rows(), grain, [&](std::int64_t begin, std::int64_t end) {
    Eigen::RowVectorXd sum(values.cols());
    for (std::int64_t p = begin; p < end; ++p) {
      sum.setZero();
      for (Matrix::InnerIterator entry(matrix_, p); entry; ++entry) {
        sum += entry.value() * values.row(entry.col()).template cast<double>();
        sum.head(num_positions) -= entry.value() * rest_.row(entry.col()).head(num_positions);
      }
      sum.head(num_positions) += points_.row(p).head(num_positions);
      out.row(p) = sum.template cast<Scalar>();
    }
  });
}

template <class Scalar>
void ScatteredTransfer::evaluate(const Values<Scalar>& values, Values<Scalar>& out) const {
  if (values.cols() < rest_.cols())
    raise("vertices of {} coordinates, but the mesh at rest has {}: displacements need as many", values.cols(),
          rest_.cols());
  apply(values, rest_.cols(), out);
}

template <class Scalar>
Values<Scalar> ScatteredTransfer::evaluate(const Values<Scalar>& values) const {
  Values<Scalar> out;
  evaluate(values, out);
  return out;
}

template <class Scalar>
void ScatteredTransfer::evaluate_field(const Values<Scalar>& values, Values<Scalar>& out) const {
  apply(values, 0, out);
}

template Values<float> ScatteredTransfer::evaluate(const Values<float>&) const;
template Values<double> ScatteredTransfer::evaluate(const Values<double>&) const;
template void ScatteredTransfer::evaluate(const Values<float>&, Values<float>&) const;
template void ScatteredTransfer::evaluate(const Values<double>&, Values<double>&) const;
template void ScatteredTransfer::evaluate_field(const Values<float>&, Values<float>&) const;
template void ScatteredTransfer::evaluate_field(const Values<double>&, Values<double>&) const;

}  // namespace halfgrad
