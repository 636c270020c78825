// Agreement with an independent reference implementation, on meshes of every kind that it covers.
#include <gtest/gtest.h>

#include <fstream>
#include <map>
#include <nlohmann/json.hpp>

#include "reconstruction/cell_averages.hpp"
#include "reconstruction/registry.hpp"
#include "support/shared_data.hpp"

namespace halfgrad {
namespace {

using nlohmann::json;

// Elements by the reference's names; false where the element is not registered.
bool add_block(const std::string& name, const json& connectivity, std::vector<AnyBlock>& blocks) {
  static const std::map<std::string, int> vtk_ids = {{"seg", 3},  {"tri", 5},    {"quad", 9},    {"tet", 10},
                                                     {"hex", 12}, {"wedge", 13}, {"pyramid", 14}};
  bool known = false;
  Elements::for_each([&]<class E>() {
    if (E::vtk_id != vtk_ids.at(name)) return;
    known = true;
    ElementBlock<E> block;
    block.cells.resize(static_cast<Eigen::Index>(connectivity.size()), E::num_nodes);
    for (std::size_t c = 0; c < connectivity.size(); ++c)
      for (int i = 0; i < E::num_nodes; ++i) block.cells(static_cast<Eigen::Index>(c), i) = connectivity[c][i];
    blocks.push_back(block);
  });
  return known;
}

class Golden : public testing::TestWithParam<const char*> {
 protected:
  void SetUp() override {
    const auto path = shared_path(std::string("golden/golden_") + GetParam() + ".json");
    if (!path) GTEST_SKIP() << "the golden data are not here";
    data = json::parse(std::ifstream(*path));
    std::vector<AnyBlock> blocks;
    for (const json& block : data["blocks"])
      if (!add_block(block[0], block[1], blocks)) GTEST_SKIP() << "no element for " << block[0];
    const auto rows = [](const json& table) {
      Points points(static_cast<Eigen::Index>(table.size()), static_cast<Eigen::Index>(table[0].size()));
      for (Eigen::Index i = 0; i < points.rows(); ++i)
        for (Eigen::Index a = 0; a < points.cols(); ++a) points(i, a) = table[i][a];
      return points;
    };
    mesh = Mesh(rows(data["X"]), blocks);
    deformed = rows(data["x"]);
    for (Index v = 0; v < mesh.num_vertices(); ++v) vertices.push_back(v);
  }

  Reconstruction reconstruct(const json& specification) const {
    return make_reconstructor(specification).reconstructor->reconstruct(CellGradients(mesh), vertices);
  }

  // Greatest difference of an array of the reference to a row, component by component.
  double difference(const json& expected, const Values<double>& rows, Eigen::Index row) const {
    double worst = 0;
    for (Eigen::Index i = 0; i < deformed.cols(); ++i)
      for (int a = 0; a < mesh.gdim(); ++a)
        worst = std::max(worst, std::abs(rows(row, i * mesh.gdim() + a) - expected[i][a].get<double>()));
    return worst;
  }

  void expect_gradients(const json& specification, const std::string& name, double tolerance) {
    const Values<double> gradients = apply_stencils<double>(reconstruct(specification).stencils, deformed);
    double worst = 0;
    for (Index v : vertices) worst = std::max(worst, difference(data["F"][name][v], gradients, v));
    EXPECT_LT(worst, tolerance) << name;
  }

  json data;
  Mesh mesh;
  Values<double> deformed;
  std::vector<Index> vertices;
};

TEST_P(Golden, BoundaryFlags) {
  const CellGradients cells(mesh);
  for (Index v : vertices) EXPECT_EQ(cells.on_boundary(v), data["boundary"][v].get<int>() != 0) << v;
}

TEST_P(Golden, ChandrashekarGargCellWeights) {
  const CellGradients cells(mesh);
  const ChandrashekarGarg reconstructor;
  for (Index v : vertices) {
    const CellWeights weights = reconstructor.weights(cells, v);
    std::map<Index, double> found;
    for (std::size_t k = 0; k < weights.cells.size(); ++k) found[weights.cells[k]] = weights.weights[k];
    const json& expected = data["cg1_weights"][v];
    ASSERT_EQ(found.size(), expected[0].size());
    for (std::size_t k = 0; k < found.size(); ++k)
      EXPECT_NEAR(found.at(expected[0][k]), expected[1][k].get<double>(), 1e-12);
  }
}

TEST_P(Golden, AverageGradients) {
  expect_gradients("chandrashekar_garg", "cg1", 1e-12);
  expect_gradients("unweighted_average", "unweighted", 1e-12);
  expect_gradients("volume_average", "vol", 1e-12);
}

// Where the last vertex of a patch ties with further ones (edges of the cube, which are not jittered), we take all of
// them and the reference takes some: its patches have even sizes and 45, ours then have other ones.
bool same_patch(const StencilDiagnostics& row) {
  return row.num_points <= 45 || row.num_points == 60 || row.num_points == 90 || row.num_points == 130;
}

// Round-off of two factorisations of a matrix whose condition is about 1e7.
TEST_P(Golden, KrigingGradients) {
  const std::vector<std::pair<json, std::string>> methods = {{{{"kriging", {{"patch", "wide"}}}}, "best"},
                                                             {{{"kriging", {{"patch", "lean"}}}}, "lean"},
                                                             {{{"kriging", {{"drift", "cubic"}}}}, "cubicfit"}};
  for (const auto& [specification, name] : methods) {
    const Reconstruction found = reconstruct(specification);
    const Values<double> gradients = apply_stencils<double>(found.stencils, deformed);
    double worst = 0;
    Index num_compared = 0;
    for (Index v : vertices) {
      if (!same_patch(found.stencils.diagnostics[v])) continue;
      worst = std::max(worst, difference(data["F"][name][v], gradients, v));
      ++num_compared;
    }
    EXPECT_LT(worst, 1e-8) << name;
    EXPECT_GT(num_compared, 0.5 * mesh.num_vertices()) << name;
  }
}

TEST_P(Golden, KrigingHessians) {
  const Reconstruction found = reconstruct({{"kriging", {{"drift", "cubic"}}}});
  const Values<double> hessians = apply_hessian_stencils<double>(found.stencils, deformed);
  const int gdim = mesh.gdim(), size = num_symmetric(gdim);
  double worst = 0;
  for (Index v : vertices) {
    if (!same_patch(found.stencils.diagnostics[v])) continue;
    for (Eigen::Index i = 0; i < deformed.cols(); ++i)
      for (int a = 0, s = 0; a < gdim; ++a)
        for (int b = a; b < gdim; ++b, ++s)
          worst = std::max(worst, std::abs(hessians(v, i * size + s) - data["Q_cubicfit"][v][i][a][b].get<double>()));
  }
  EXPECT_LT(worst, 1e-7);
}

INSTANTIATE_TEST_SUITE_P(Meshes, Golden, testing::Values("jseg", "jkuhn2", "jkuhn3", "jhex", "jmixed"),
                         [](const auto& mesh) { return std::string(mesh.param); });

}  // namespace
}  // namespace halfgrad
