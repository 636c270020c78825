#include "experiments/tessellation.hpp"

#include "framework/boundary_facets.hpp"
#include "framework/error.hpp"

namespace halfgrad {

namespace {

class Tessellator {
 public:
  Tessellator(const Mesh& mesh, int subdivisions) : mesh_(mesh), n_(subdivisions) {}

  /// A convex polygon by its vertices, as a fan of triangles.
  void add_polygon(std::span<const Index> corners) {
    for (std::size_t i = 1; i + 1 < corners.size(); ++i) add_triangle(corners[0], corners[i], corners[i + 1]);
  }

  PointCloud finish() {
    PointCloud cloud;
    cloud.positions.resize(static_cast<Eigen::Index>(points_.size()), mesh_.gdim());
    for (std::size_t p = 0; p < points_.size(); ++p)
      cloud.positions.row(static_cast<Eigen::Index>(p)) = points_[p].transpose();
    cloud.faces = std::move(faces_);
    return cloud;
  }

 private:
  void add_triangle(Index a, Index b, Index c) {
    const auto corner = [&](Index v) -> Vector { return mesh_.vertices().row(v).transpose(); };
    const Vector A = corner(a), B = corner(b), C = corner(c);
    const auto first = static_cast<Index>(points_.size());
    // Row j has n − j + 1 points.
    const auto number = [&](int i, int j) { return first + j * (n_ + 1) - j * (j - 1) / 2 + i; };
    for (int j = 0; j <= n_; ++j)
      for (int i = 0; i + j <= n_; ++i) points_.emplace_back((A * (n_ - i - j) + B * i + C * j) / n_);
    for (int j = 0; j < n_; ++j)
      for (int i = 0; i + j < n_; ++i) {
        add_face({number(i, j), number(i + 1, j), number(i, j + 1)});
        if (i + j + 1 < n_) add_face({number(i + 1, j), number(i + 1, j + 1), number(i, j + 1)});
      }
  }

  void add_face(std::array<Index, 3> corners) {
    faces_.entries.insert(faces_.entries.end(), corners.begin(), corners.end());
    faces_.offsets.push_back(static_cast<Offset>(faces_.entries.size()));
  }

  const Mesh& mesh_;
  int n_;
  std::vector<Vector> points_;
  IndexTable faces_;
};

}  // namespace

PointCloud tessellation(const Mesh& mesh, int subdivisions) {
  if (mesh.gdim() != 2 && mesh.gdim() != 3)
    raise("a tessellation needs a mesh of the plane or of space, but this one has dimension {}", mesh.gdim());
  Tessellator tessellator(mesh, subdivisions);
  if (mesh.gdim() == 2 || mesh.is_surface()) {
    for (Index cell = 0; cell < mesh.num_cells(); ++cell) tessellator.add_polygon(mesh.cell_vertices(cell));
    return tessellator.finish();
  }
  for (const CellFacet& side : boundary_facets(mesh, std::vector<char>(mesh.num_cells(), 0)))
    with_cell(mesh, side.cell, [&]<Element E>(const ElementBlock<E>& block, Eigen::Index row) {
      const Facet& facet = E::facets[side.facet];
      std::array<Index, 4> corners{};
      for (int i = 0; i < facet.num_nodes; ++i) corners[i] = block.cells(row, facet.nodes[i]);
      tessellator.add_polygon({corners.data(), static_cast<std::size_t>(facet.num_nodes)});
    });
  return tessellator.finish();
}

}  // namespace halfgrad
