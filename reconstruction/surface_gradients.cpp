#include "reconstruction/surface_gradients.hpp"

#include <Eigen/LU>
#include <algorithm>
#include <unordered_map>

#include "framework/error.hpp"
#include "framework/parallel.hpp"
#include "framework/surface.hpp"
#include "framework/tangent_plane.hpp"
#include "reconstruction/row_assembly.hpp"

namespace halfgrad {

namespace {

// As many as the widest patch of a reconstructor takes in two dimensions.
constexpr int num_rings = 4;

// A vertex's surroundings unrolled into its tangent plane: vertex 0 is the vertex.
struct Patch {
  Mesh mesh;
  std::vector<Index> vertices;  // of the surface
};

class Patches {
 public:
  explicit Patches(const Mesh& surface)
      : surface_(&surface), vertex_cells_(vertex_cells(surface)), normals_(vertex_area_vectors(surface)) {
    for_each_block(surface, [&]<Element E>(const ElementBlock<E>& block, Index) {
      if constexpr (E::dim == 2)
        for (Eigen::Index c = 0; c < block.cells.rows(); ++c) {
          Eigen::Matrix<double, E::num_nodes, 3> nodes;
          for (int i = 0; i < E::num_nodes; ++i) nodes.row(i) = surface.vertices().row(block.cells(c, i));
          areas_.push_back(area_vector<E::num_nodes>(nodes));
        }
    });
  }

  std::span<const Index> cells_of(Index vertex) const { return vertex_cells_[vertex]; }

  // False where no cell at the vertex has area.
  bool make(Index vertex, Patch& patch) const {
    const Eigen::Vector3d normal = normals_.row(vertex).transpose();
    if (!(normal.norm() > 0)) return false;
    std::unordered_map<Index, Index> number;
    std::vector<Index> cells;
    patch.vertices.assign(1, vertex);
    number[vertex] = 0;
    std::unordered_map<Index, char> seen;
    std::size_t ring_begin = 0;
    for (int ring = 0; ring < num_rings; ++ring) {
      const std::size_t ring_end = patch.vertices.size();
      for (std::size_t i = ring_begin; i < ring_end; ++i)
        for (Index cell : cells_of(patch.vertices[i])) {
          if (!(areas_[cell].dot(normal) > 0) || !seen.try_emplace(cell).second) continue;
          cells.push_back(cell);
          for (Index v : surface_->cell_vertices(cell))
            if (number.try_emplace(v, static_cast<Index>(patch.vertices.size())).second) patch.vertices.push_back(v);
        }
      ring_begin = ring_end;
    }
    if (cells.empty()) return false;

    const Eigen::Matrix<double, 3, 2> basis = tangent_basis(normal);
    Points flat(static_cast<Eigen::Index>(patch.vertices.size()), 2);
    for (std::size_t i = 0; i < patch.vertices.size(); ++i) {
      const Eigen::RowVector3d way = surface_->vertices().row(patch.vertices[i]) - surface_->vertices().row(vertex);
      const Eigen::RowVector2d along = way * basis;
      const double length = along.norm();
      flat.row(static_cast<Eigen::Index>(i)) = length > 0 ? Eigen::RowVector2d(along * (way.norm() / length)) : along;
    }
    // Ascending cells, so that nothing depends on the search; one block an element.
    std::sort(cells.begin(), cells.end());
    std::vector<AnyBlock> blocks;
    Elements::for_each([&]<class E>() {
      if constexpr (E::dim == 2) {
        std::vector<Index> nodes;
        for (Index cell : cells)
          if (std::holds_alternative<ElementBlock<E>>(surface_->blocks()[surface_->block_of(cell)]))
            for (Index v : surface_->cell_vertices(cell)) nodes.push_back(number[v]);
        if (nodes.empty()) return;
        ElementBlock<E> block;
        block.cells.resize(static_cast<Eigen::Index>(nodes.size()) / E::num_nodes, E::num_nodes);
        std::copy(nodes.begin(), nodes.end(), block.cells.data());
        blocks.push_back(std::move(block));
      }
    });
    patch.mesh = Mesh(std::move(flat), std::move(blocks));
    return true;
  }

 private:
  const Mesh* surface_;
  IndexTable vertex_cells_;
  Points normals_;
  std::vector<Eigen::Vector3d> areas_;
};

// The first row of a table on a patch as a row on the surface: with G = Σ (X_j − X_v) wᵀ_j, 3 × 2, the tangents of the
// rest surface as the row sees them, F = (Σ (x_j − x_v) wᵀ_j) G⁺.
void lift_row(const Mesh& surface, const Patch& patch, const GradientStencilTable& table, StencilRow& row) {
  row.clear();
  row.diagnostics.rule = StencilRule::none;
  if (table.num_rows() == 0 || table.offsets[1] == 0) return;
  Eigen::Matrix<double, 3, 2> tangents = Eigen::Matrix<double, 3, 2>::Zero();
  const Index vertex = patch.vertices[0];
  for (Offset e = 0; e < table.offsets[1]; ++e) {
    const Index other = patch.vertices[table.neighbors[e]];
    const Eigen::Vector3d way = (surface.vertices().row(other) - surface.vertices().row(vertex)).transpose();
    tangents += way * Eigen::RowVector2d(table.weights[2 * e], table.weights[2 * e + 1]);
  }
  const Eigen::Matrix2d metric = tangents.transpose() * tangents;
  if (!(metric.determinant() > 1e-12 * metric.squaredNorm())) return;
  const Eigen::Matrix<double, 3, 2> lift = tangents * metric.inverse();
  std::vector<std::pair<Index, Offset>> order;
  for (Offset e = 0; e < table.offsets[1]; ++e) order.emplace_back(patch.vertices[table.neighbors[e]], e);
  std::sort(order.begin(), order.end());
  for (const auto& [other, e] : order) {
    const Eigen::Vector3d weight = lift * Eigen::Vector2d(table.weights[2 * e], table.weights[2 * e + 1]);
    row.neighbors.push_back(other);
    row.weights.insert(row.weights.end(), weight.data(), weight.data() + 3);
  }
  if (!table.diagnostics.empty()) row.diagnostics = table.diagnostics[0];
}

GradientStencilTable table_of(const std::vector<Index>& vertices, const std::vector<StencilRow>& rows) {
  GradientStencilTable table;
  table.gdim = 3;
  table.vertices = vertices;
  for (const StencilRow& row : rows) {
    table.neighbors.insert(table.neighbors.end(), row.neighbors.begin(), row.neighbors.end());
    table.weights.insert(table.weights.end(), row.weights.begin(), row.weights.end());
    table.diagnostics.push_back(row.diagnostics);
    table.offsets.push_back(table.num_entries());
  }
  return table;
}

}  // namespace

Reconstruction surface_gradients(const VertexGradientReconstructor& reconstructor, const Mesh& surface,
                                 std::span<const Index> vertices) {
  const Patches patches(surface);
  std::vector<Index> wanted(vertices.begin(), vertices.end());
  std::vector<StencilRow> rows, averaging;
  std::vector<double> caution;
  // Rows of wanted[first …]; whether any of them is a blend.
  const auto make_rows = [&](std::size_t first) {
    for (std::vector<StencilRow>* table : {&rows, &averaging}) table->resize(wanted.size());
    caution.resize(wanted.size(), 0);
    std::vector<char> has_blend(wanted.size(), 0);
    parallel_for(static_cast<std::int64_t>(wanted.size() - first), 16, [&](std::int64_t begin, std::int64_t end) {
      Patch patch;
      for (std::size_t r = first + static_cast<std::size_t>(begin); r < first + static_cast<std::size_t>(end); ++r) {
        rows[r].diagnostics.rule = averaging[r].diagnostics.rule = StencilRule::none;
        if (!patches.make(wanted[r], patch)) continue;
        const std::array<Index, 1> center = {0};
        const Reconstruction flat = reconstructor.reconstruct(CellGradients(patch.mesh), center);
        lift_row(surface, patch, flat.stencils, rows[r]);
        if (!flat.blend) continue;
        lift_row(surface, patch, flat.blend->averaging, averaging[r]);
        caution[r] = flat.blend->caution[0];
        has_blend[r] = 1;
      }
    });
    return std::find(has_blend.begin(), has_blend.end(), 1) != has_blend.end();
  };
  const bool blended = make_rows(0);

  Reconstruction result;
  if (!blended) {
    result.stencils = table_of(wanted, rows);
    return result;
  }
  // The edges to the neighbours are tested with rows of theirs. The prediction takes no share: it would take an edge's
  // part along the normal for a mismatch of the gradients, and spoil the rest shape.
  AdaptiveBlend blend;
  blend.averaging = table_of(wanted, averaging);
  std::vector<Index> row_of(static_cast<std::size_t>(surface.num_vertices()), -1), neighbors;
  for (std::size_t r = 0; r < wanted.size(); ++r) row_of[wanted[r]] = static_cast<Index>(r);
  for (Index vertex : vertices) {
    neighbors.clear();
    for (Index cell : patches.cells_of(vertex))
      for (Index v : surface.cell_vertices(cell))
        if (v != vertex) neighbors.push_back(v);
    std::sort(neighbors.begin(), neighbors.end());
    neighbors.erase(std::unique(neighbors.begin(), neighbors.end()), neighbors.end());
    for (Index v : neighbors) {
      const Eigen::Vector3d edge = (surface.vertices().row(v) - surface.vertices().row(vertex)).transpose();
      if (!(edge.squaredNorm() > 0)) continue;
      if (row_of[v] < 0) {
        row_of[v] = static_cast<Index>(wanted.size());
        wanted.push_back(v);
      }
      blend.edge_rows.push_back(row_of[v]);
      blend.edges.insert(blend.edges.end(), edge.data(), edge.data() + 3);
    }
    blend.edge_offsets.push_back(static_cast<Offset>(blend.edge_rows.size()));
  }
  make_rows(vertices.size());
  result.stencils = table_of(wanted, rows);
  blend.beyond = split_rows(result.stencils, static_cast<Index>(vertices.size()));
  blend.caution.assign(caution.begin(), caution.begin() + result.stencils.num_rows());
  result.blend = std::move(blend);
  return result;
}

}  // namespace halfgrad
