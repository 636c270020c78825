// Never worse than linear: the vertex-based stencils on the meshes that destroy averages of cell gradients.
#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <iostream>
#include <nlohmann/json.hpp>
#include <numeric>

#include "experiments/ball.hpp"
#include "experiments/fields.hpp"
#include "experiments/lattice.hpp"
#include "experiments/point_source.hpp"
#include "experiments/random_delaunay.hpp"
#include "framework/embedding.hpp"
#include "framework/interpolant.hpp"
#include "framework/io/mesh_file.hpp"
#include "reconstruction/registry.hpp"

namespace halfgrad {
namespace {

using nlohmann::json;

const json wide = "kriging", lean = {{"kriging", {{"patch", "lean"}}}}, cubic = {{"kriging", {{"drift", "cubic"}}}},
           paper = "chandrashekar_garg";

// A few points in every cell, as the flattest are where an error shows, and many in the volume.
Points points_everywhere(const Mesh& mesh) {
  std::vector<Vector> found;
  for_each_block(mesh, [&]<Element E>(const ElementBlock<E>& block, Index) {
    for (Eigen::Index c = 0; c < block.cells.rows(); ++c) {
      const auto positions = node_positions(mesh, block, c);
      found.push_back(positions.transpose() * E::shape(E::center()));
      for (int i = 0; i < 2; ++i)
        found.push_back(positions.transpose() *
                        E::shape((0.4 * E::center() + 0.6 * E::nodes().row(i).transpose()).eval()));
    }
  });
  constexpr Index num_random = 2000;
  Points points(static_cast<Eigen::Index>(found.size()) + num_random, mesh.gdim());
  points.bottomRows(num_random) = random_points(mesh, num_random, 1);
  for (std::size_t p = 0; p < found.size(); ++p) points.row(static_cast<Eigen::Index>(p)) = found[p].transpose();
  return points;
}

// Greatest error of linear over greatest error of Phong, the worst of several fields, far away and zoomed in.
double worst_gain(const Mesh& mesh, const json& reconstructor) {
  double worst = std::numeric_limits<double>::infinity();
  for (const double zoom : {1.0, 0.25}) {
    const Mesh zoomed(mesh.vertices() * zoom, mesh.blocks());
    const Points points = points_everywhere(zoomed);
    const Embedding embedding = embed(zoomed, points, {.outside = Outside::nearest});
    const Reconstruction rows =
        make_reconstructor(reconstructor)
            .reconstructor->reconstruct(CellGradients(zoomed), active_vertices(zoomed, embedding));
    const Interpolant<double> linear(zoomed, embedding, named_rule("linear"), nullptr),
        phong(zoomed, embedding, named_rule("phong"), &rows);
    for (const char* name : {"bend_twist", mesh.gdim() == 3 ? "kelvinlet_pinch" : "radial_twist", "waves"}) {
      const auto field = make_field(name, "", {mesh.gdim(), 1});
      const Points values = field_values(*field, zoomed.vertices()), truth = field_values(*field, points);
      const Points found = phong.evaluate(values);
      EXPECT_TRUE(found.allFinite());
      worst = std::min(worst, (linear.evaluate(values) - truth).rowwise().norm().maxCoeff() /
                                  (found - truth).rowwise().norm().maxCoeff());
    }
  }
  return worst;
}

double greatest_absolute_sum(const Mesh& mesh, const json& reconstructor) {
  std::vector<Index> vertices(mesh.num_vertices());
  std::iota(vertices.begin(), vertices.end(), 0);
  double greatest = 0;
  for (const StencilDiagnostics& row :
       make_reconstructor(reconstructor).reconstructor->reconstruct(CellGradients(mesh), vertices).stencils.diagnostics)
    greatest = std::max<double>(greatest, row.absolute_sum);
  return greatest;
}

Mesh lattice(std::array<int, 3> cells, double jitter) {
  LatticeOptions options;
  options.cells = cells;
  for (int a = 0; a < 3; ++a) {
    options.size[a] = cells[a] / 6.0;
    options.origin[a] = -options.size[a] / 2;
  }
  options.jitter = jitter;
  return make_lattice(options);
}

// Some cells of a tetrahedral mesh.
Mesh first_cells(const Mesh& mesh, Eigen::Index count) {
  ElementBlock<Tetrahedron> block{std::get<ElementBlock<Tetrahedron>>(mesh.blocks()[0]).cells.topRows(count)};
  return Mesh(mesh.vertices(), {block});
}

// A tetrahedron of a height relative to its base on every triangle of the top side.
Mesh with_flat_cells(double height) {
  const Mesh mesh = lattice({5, 5, 5}, 0.2);
  const auto& cells = std::get<ElementBlock<Tetrahedron>>(mesh.blocks()[0]).cells;
  const double top = mesh.vertices().col(2).maxCoeff();
  std::vector<Eigen::RowVector3d> apexes;
  std::vector<std::array<Index, 4>> flat;
  for (Eigen::Index c = 0; c < cells.rows(); ++c) {
    std::vector<Index> base;
    for (int i = 0; i < 4; ++i)
      if (mesh.vertices()(cells(c, i), 2) > top - 1e-9) base.push_back(cells(c, i));
    if (base.size() != 3) continue;
    const Eigen::RowVector3d a = mesh.vertices().row(base[0]), b = mesh.vertices().row(base[1]),
                             d = mesh.vertices().row(base[2]);
    if ((b - a).cross(d - a)[2] < 0) std::swap(base[1], base[2]);
    apexes.push_back((a + b + d) / 3 + Eigen::RowVector3d(0, 0, height / 6));
    flat.push_back({base[0], base[1], base[2], static_cast<Index>(mesh.num_vertices() + apexes.size() - 1)});
  }
  Points vertices(mesh.num_vertices() + static_cast<Eigen::Index>(apexes.size()), 3);
  vertices.topRows(mesh.num_vertices()) = mesh.vertices();
  for (std::size_t k = 0; k < apexes.size(); ++k)
    vertices.row(mesh.num_vertices() + static_cast<Eigen::Index>(k)) = apexes[k];
  ElementBlock<Tetrahedron> block;
  block.cells.resize(cells.rows() + static_cast<Eigen::Index>(flat.size()), 4);
  block.cells.topRows(cells.rows()) = cells;
  for (std::size_t k = 0; k < flat.size(); ++k)
    for (int i = 0; i < 4; ++i) block.cells(cells.rows() + static_cast<Eigen::Index>(k), i) = flat[k][i];
  return Mesh(std::move(vertices), {block});
}

void expect_never_worse(const Mesh& mesh, const char* name) {
  for (const json& reconstructor : {wide, lean, cubic})
    EXPECT_GE(worst_gain(mesh, reconstructor), 0.99) << name << " " << reconstructor;
}

TEST(NeverWorseThanLinear, OnRandomDelaunayMeshes) {
  for (const std::uint64_t seed : {1, 2, 3}) {
    const Mesh mesh = make_random_delaunay({.gdim = 3, .num_points = 200, .seed = seed});
    expect_never_worse(mesh, "random tetrahedra");
    EXPECT_LE(greatest_absolute_sum(mesh, wide), 35);
    // The control: averages of cell gradients are destroyed by slivers.
    EXPECT_LT(worst_gain(mesh, paper), 0.5);
    expect_never_worse(make_random_delaunay({.gdim = 2, .num_points = 200, .seed = seed}), "random triangles");
  }
}

TEST(NeverWorseThanLinear, OnFlatBoundaryCells) {
  for (const double height : {1e-2, 1e-5}) {
    const Mesh mesh = with_flat_cells(height);
    expect_never_worse(mesh, "flat cells");
    EXPECT_LT(worst_gain(mesh, paper), 0.5);
  }
}

TEST(NeverWorseThanLinear, OnThinMeshes) {
  expect_never_worse(lattice({6, 6, 1}, 0), "slab");
  expect_never_worse(lattice({6, 6, 1}, 0.2), "jittered slab");
  expect_never_worse(lattice({8, 1, 1}, 0), "strip");
  const Mesh cube = lattice({1, 1, 1}, 0);
  // A few cells: what their vertices do not determine must not be made up.
  for (int count = 1; count <= 6; ++count) expect_never_worse(first_cells(cube, count), "cells of one cube");
}

TEST(AbsoluteSums, StayBelowTwentyOnGoodMeshes) {
  BallOptions ball;
  ball.spacing = 0.2;
  for (const Mesh& mesh : {make_ball(ball), lattice({5, 5, 5}, 0), lattice({5, 5, 5}, 0.2)})
    for (const json& reconstructor : {wide, lean}) EXPECT_LE(greatest_absolute_sum(mesh, reconstructor), 20);
}

// Multiplications and additions of a 3 × 3 gradient: nine a stencil entry; the paper's scheme has nine a cell and
// vertex for the averages, and 27 a cell for the gradients that they average.
TEST(StencilEntries, CostLittleMoreThanThePapersTwoStages) {
  const Mesh mesh = read_mesh(HALFGRAD_CONFIGS "/meshes/ball.msh");
  std::vector<Index> vertices(mesh.num_vertices());
  std::iota(vertices.begin(), vertices.end(), 0);
  const double papers = 9.0 * 4 * mesh.num_cells() + 27.0 * mesh.num_cells();
  for (const auto& [reconstructor, most] : {std::pair(lean, 0.8), std::pair(wide, 1.3)}) {
    const auto rows = make_reconstructor(reconstructor).reconstructor->reconstruct(CellGradients(mesh), vertices);
    const double ratio = 9.0 * rows.stencils.num_entries() / papers;
    std::cout << reconstructor << ": " << 9.0 * rows.stencils.num_entries() / mesh.num_vertices() << " a vertex, "
              << ratio << " of the paper's " << papers / mesh.num_vertices() << "\n";
    EXPECT_LE(ratio, most) << reconstructor;
  }
}

// Cells without volume are no part of the mesh for averages; for patches they only say which vertices are near.
TEST(CellsWithoutVolume, LeaveTheAveragesAloneAndQuadraticsExact) {
  const Mesh spoilt = with_flat_cells(0), good = lattice({5, 5, 5}, 0.2);
  std::vector<Index> vertices(good.num_vertices());
  std::iota(vertices.begin(), vertices.end(), 0);
  const Values<double> values = spoilt.vertices().rowwise().squaredNorm();
  for (const ReconstructorEntry& entry : reconstructor_registry()) {
    if (entry.name == "centered_difference") continue;  // for grids only
    const auto gradients = [&](const Mesh& mesh) {
      const Reconstruction rows =
          make_reconstructor(std::string(entry.name)).reconstructor->reconstruct(CellGradients(mesh), vertices);
      const Values<double> own = values.topRows(mesh.num_vertices());
      return rows.blend ? blended_gradients(rows, own) : apply_stencils(rows.stencils, own);
    };
    const bool fits_values = entry.name == "kriging" || entry.name == "ppr" || entry.name == "adaptive";
    const Values<double> expected = fits_values ? Values<double>(2 * good.vertices()) : gradients(good);
    EXPECT_LT((gradients(spoilt) - expected).cwiseAbs().maxCoeff(), 1e-9) << entry.name;
  }
}

}  // namespace
}  // namespace halfgrad
