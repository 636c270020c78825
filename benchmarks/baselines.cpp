#include "benchmarks/baselines.hpp"

#include <Eigen/LU>

#include "framework/cell_gradients.hpp"

namespace halfgrad::benchmarks {

ScalarLinear::ScalarLinear(const Mesh& mesh, const Embedding& embedding) {
  for (Index p = 0; p < embedding.num_points(); ++p) {
    const auto vertices_of_cell = mesh.cell_vertices(embedding.cells[p]);
    const Eigen::Vector4d beta = Tetrahedron::shape(embedding.local.row(p).transpose());
    for (int i = 0; i < 4; ++i) {
      vertices.push_back(vertices_of_cell[i]);
      weights.push_back(static_cast<float>(beta[i]));
    }
  }
}

void ScalarLinear::evaluate(const float* values, float* out) const {
  const std::size_t num_points = vertices.size() / 4;
  for (std::size_t p = 0; p < num_points; ++p) {
    const Index* v = &vertices[4 * p];
    const float* b = &weights[4 * p];
    for (int c = 0; c < 3; ++c)
      out[3 * p + c] = b[0] * values[3 * v[0] + c] + b[1] * values[3 * v[1] + c] + b[2] * values[3 * v[2] + c] +
                       b[3] * values[3 * v[3] + c];
  }
}

PaperStyle::PaperStyle(const Mesh& mesh, const Embedding& embedding, const Points& points)
    : num_vertices_(mesh.num_vertices()) {
  for (Index cell = 0; cell < mesh.num_cells(); ++cell) {
    const auto v = mesh.cell_vertices(cell);
    Eigen::Matrix3d edges;
    for (int k = 0; k < 3; ++k) edges.col(k) = (mesh.vertices().row(v[k + 1]) - mesh.vertices().row(v[0])).transpose();
    const Eigen::Matrix3d inverse = edges.inverse();
    tetrahedra_.insert(tetrahedra_.end(), v.begin(), v.end());
    for (int k = 0; k < 3; ++k)
      for (int a = 0; a < 3; ++a) inverse_edges_.push_back(static_cast<float>(inverse(k, a)));
  }
  const auto copy = [](const Points& from, std::vector<float>& to) {
    for (Eigen::Index i = 0; i < from.size(); ++i) to.push_back(static_cast<float>(from.data()[i]));
  };
  copy(mesh.vertices(), rest_);
  copy(points, points_);
  const CellGradients cells(mesh);
  const ChandrashekarGarg rule;
  cell_offsets_.push_back(0);
  for (Index v = 0; v < num_vertices_; ++v) {
    const CellWeights row = rule.weights(cells, v);
    cells_.insert(cells_.end(), row.cells.begin(), row.cells.end());
    cell_weights_.insert(cell_weights_.end(), row.weights.begin(), row.weights.end());
    cell_offsets_.push_back(static_cast<Offset>(cells_.size()));
  }
  point_cells_ = embedding.cells;
  for (Index p = 0; p < embedding.num_points(); ++p) {
    const Eigen::Vector4d beta = Tetrahedron::shape(embedding.local.row(p).transpose());
    for (int i = 0; i < 4; ++i) barycentrics_.push_back(static_cast<float>(beta[i]));
  }
  cell_gradients_.resize(inverse_edges_.size());
  gradients_.resize(9 * static_cast<std::size_t>(num_vertices_));
}

void PaperStyle::evaluate(const float* values, float* out) {
  const std::size_t num_cells = tetrahedra_.size() / 4;
  for (std::size_t cell = 0; cell < num_cells; ++cell) {
    const Index* v = &tetrahedra_[4 * cell];
    for (int c = 0; c < 3; ++c)
      for (int a = 0; a < 3; ++a) {
        float sum = 0;
        for (int k = 0; k < 3; ++k)
          sum += (values[3 * v[k + 1] + c] - values[3 * v[0] + c]) * inverse_edges_[9 * cell + 3 * k + a];
        cell_gradients_[9 * cell + 3 * c + a] = sum;
      }
  }
  for (Index v = 0; v < num_vertices_; ++v)
    for (int k = 0; k < 9; ++k) {
      float sum = 0;
      for (Offset e = cell_offsets_[v]; e < cell_offsets_[v + 1]; ++e)
        sum += cell_weights_[e] * cell_gradients_[9 * static_cast<std::size_t>(cells_[e]) + k];
      gradients_[9 * static_cast<std::size_t>(v) + k] = sum;
    }
  for (std::size_t p = 0; p < point_cells_.size(); ++p) {
    const Index* v = &tetrahedra_[4 * static_cast<std::size_t>(point_cells_[p])];
    float linear[3] = {}, affine[3] = {};
    for (int i = 0; i < 4; ++i) {
      const float beta = barycentrics_[4 * p + i];
      for (int c = 0; c < 3; ++c) {
        const float x = values[3 * v[i] + c];
        float moved = x;
        for (int a = 0; a < 3; ++a)
          moved += gradients_[9 * static_cast<std::size_t>(v[i]) + 3 * c + a] *
                   (points_[3 * p + a] - rest_[3 * static_cast<std::size_t>(v[i]) + a]);
        linear[c] += beta * x;
        affine[c] += beta * moved;
      }
    }
    for (int c = 0; c < 3; ++c) out[3 * p + c] = 0.5f * (linear[c] + affine[c]);
  }
}

}  // namespace halfgrad::benchmarks
