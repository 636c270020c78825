// Meshes that mix elements: conforming, continuous across every facet, reconstructed across blocks.
#include <gtest/gtest.h>

#include <map>
#include <nlohmann/json.hpp>
#include <set>

#include "experiments/lattice.hpp"
#include "framework/interpolant.hpp"
#include "reconstruction/registry.hpp"

namespace halfgrad {
namespace {

Mesh mixed(const char* pattern, int n, double jitter) {
  LatticeOptions options;
  options.element = "mixed";
  options.pattern = pattern;
  options.cells = {n, n, n};
  options.jitter = jitter;
  options.seed = 5;
  return make_lattice(options);
}

std::size_t num_elements(const Mesh& mesh) { return mesh.blocks().size(); }

TEST(MixedLattice, FillsTheBoxWithEveryElementAndConforms) {
  for (const double jitter : {0.0, 0.15}) {
    const Mesh solid = mixed("solid", 4, jitter), plane = mixed("plane", 5, jitter);
    EXPECT_EQ(num_elements(solid), 4u);
    EXPECT_EQ(num_elements(plane), 2u);
    for (const Mesh* mesh : {&solid, &plane}) {
      const MeshReport report = inspect(*mesh);
      EXPECT_TRUE(report.inverted_cells.empty());
      EXPECT_TRUE(report.unused_vertices.empty());
      EXPECT_EQ(report.num_nonmanifold_facets, 0);
      // A facet that two cells do not share alike would lie inside but count as boundary.
      const std::vector<char> boundary = boundary_vertices(*mesh);
      for (Index v = 0; v < mesh->num_vertices(); ++v) {
        const auto X = mesh->vertices().row(v);
        EXPECT_EQ(boundary[v] != 0, X.minCoeff() == 0 || X.maxCoeff() == 1);
      }
      if (jitter == 0) {
        EXPECT_NEAR(report.volume, 1, 1e-12);
      }
    }
  }
}

struct Side {
  Index cell;
  std::vector<Vector> nodes;  // reference coordinates of the facet's nodes, by ascending vertex
};

// The sides of every facet, by its vertices.
std::map<FacetKey, std::vector<Side>> sides_of(const Mesh& mesh) {
  std::map<FacetKey, std::vector<Side>> sides;
  for_each_block(mesh, [&]<Element E>(const ElementBlock<E>& block, Index first) {
    std::vector<FacetKey> keys;
    append_facets(block, keys);
    const NodeMatrix<E> reference = E::nodes();
    for (std::size_t k = 0; k < keys.size(); ++k) {
      const Eigen::Index row = static_cast<Eigen::Index>(k / E::facets.size());
      const Facet& facet = E::facets[k % E::facets.size()];
      Side side{static_cast<Index>(first + row), {}};
      for (Index vertex : keys[k])
        for (int i = 0; i < facet.num_nodes; ++i)
          if (block.cells(row, facet.nodes[i]) == vertex) side.nodes.push_back(reference.row(facet.nodes[i]));
      sides[keys[k]].push_back(std::move(side));
    }
  });
  return sides;
}

// Weights of a facet's nodes, by ascending vertex, at some points of it. A quadrilateral's corners in that order are
// its least corner, the two beside it and the opposite one on these lattices, jittered or not.
std::vector<std::vector<double>> facet_weights(std::size_t num_nodes) {
  std::vector<std::vector<double>> all;
  for (const double s : {0.0, 0.1, 0.37, 0.5, 0.8, 1.0})
    for (const double t : {0.0, 0.23, 0.5, 0.9, 1.0}) {
      if (num_nodes == 2) all.push_back({1 - s, s});
      if (num_nodes == 3) all.push_back({1 - s, s * (1 - t), s * t});
      if (num_nodes == 4) all.push_back({(1 - s) * (1 - t), s * (1 - t), (1 - s) * t, s * t});
    }
  return all;
}

TEST(MixedLattice, InterpolantsAreContinuousAcrossEveryFacet) {
  for (const Mesh& mesh : {mixed("solid", 4, 0.2), mixed("plane", 6, 0.2)}) {
    Embedding here, there;
    here.gdim = there.gdim = mesh.gdim();
    std::vector<Vector> local_here, local_there;
    std::map<std::pair<std::string_view, std::string_view>, int> kinds;
    for (const auto& [key, sides] : sides_of(mesh)) {
      if (sides.size() != 2) continue;
      ++kinds[std::minmax(element_name(mesh, sides[0].cell), element_name(mesh, sides[1].cell))];
      for (const std::vector<double>& weights : facet_weights(sides[0].nodes.size()))
        for (int s = 0; s < 2; ++s) {
          Vector xi = Vector::Zero(mesh.gdim());
          for (std::size_t i = 0; i < weights.size(); ++i) xi += weights[i] * sides[s].nodes[i];
          (s == 0 ? here : there).cells.push_back(sides[s].cell);
          (s == 0 ? local_here : local_there).push_back(xi);
        }
    }
    // Every pair of elements that can share a facet on these lattices does.
    EXPECT_EQ(kinds.size(), mesh.gdim() == 3 ? 7u : 2u);
    const auto fill = [&](Embedding& embedding, const std::vector<Vector>& local) {
      embedding.local.resize(static_cast<Eigen::Index>(local.size()), mesh.gdim());
      for (std::size_t p = 0; p < local.size(); ++p)
        embedding.local.row(static_cast<Eigen::Index>(p)) = local[p].transpose();
      embedding.status.assign(local.size(), PointStatus::inside);
    };
    fill(here, local_here);
    fill(there, local_there);
    std::vector<Index> all(mesh.num_vertices());
    for (Index v = 0; v < mesh.num_vertices(); ++v) all[v] = v;
    Values<double> values(mesh.num_vertices(), 3);
    for (Index v = 0; v < mesh.num_vertices(); ++v) {
      const double sum = mesh.vertices().row(v).sum();
      values.row(v) << std::sin(5 * sum), std::cos(9 * sum), mesh.vertices()(v, 0) * sum;
    }
    const Reconstruction rows = make_reconstructor(nlohmann::json{{"kriging", {{"drift", "cubic"}}}})
                                    .reconstructor->reconstruct(CellGradients(mesh), all);
    for (const char* rule : {"linear", "phong", "hermite", "dual_taylor"})
      for (const Kernel kernel : {Kernel::fast, Kernel::plain}) {
        const Values<double> a =
            Interpolant<double>(mesh, here, named_rule(rule), &rows).evaluate(values, {.kernel = kernel});
        const Values<double> b =
            Interpolant<double>(mesh, there, named_rule(rule), &rows).evaluate(values, {.kernel = kernel});
        EXPECT_LT((a - b).cwiseAbs().maxCoeff(), 1e-13) << rule;
      }
  }
}

TEST(MixedLattice, VerticesBetweenElementsUseBoth) {
  const Mesh mesh = mixed("solid", 4, 0.1);
  const CellGradients cells(mesh);
  std::vector<Index> shared;
  for (Index v = 0; v < mesh.num_vertices(); ++v) {
    std::set<std::string_view> names;
    for (Index cell : cells.cells_of(v)) names.insert(element_name(mesh, cell));
    if (names.size() == 4) shared.push_back(v);
  }
  ASSERT_FALSE(shared.empty());
  const Reconstruction rows = make_reconstructor("chandrashekar_garg").reconstructor->reconstruct(cells, shared);
  for (std::size_t r = 0; r < shared.size(); ++r) {
    std::set<Index> expected;
    for (Index cell : cells.cells_of(shared[r]))
      for (Index v : cells.vertices_of(cell))
        if (v != shared[r]) expected.insert(v);
    const auto begin = rows.stencils.neighbors.begin();
    const std::set<Index> found(begin + rows.stencils.offsets[r], begin + rows.stencils.offsets[r + 1]);
    EXPECT_EQ(found, expected);
  }
}

}  // namespace
}  // namespace halfgrad
