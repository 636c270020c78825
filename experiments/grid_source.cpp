#include "experiments/grid_source.hpp"

#include <cmath>
#include <nlohmann/json.hpp>

#include "experiments/per_axis.hpp"
#include "framework/error.hpp"
#include "framework/json_values.hpp"

namespace halfgrad {

using nlohmann::json;

namespace {

// Planes whose distances grow by the same factor, the last interval `grading` times as wide as the first.
GridAxis make_axis(int cells, double origin, double size, double grading) {
  if (grading == 1) return {cells, origin, size / cells, {}};
  GridAxis axis{cells, origin, size / cells, std::vector<double>(cells + 1)};
  const double factor = cells > 1 ? std::pow(grading, 1.0 / (cells - 1)) : 1;
  const double total = cells > 1 ? (std::pow(factor, cells) - 1) / (factor - 1) : 1;
  double at = 0, step = 1;
  for (int i = 0; i <= cells; ++i, at += step, step *= factor) axis.planes[i] = origin + size * at / total;
  axis.planes[cells] = origin + size;
  return axis;
}

// Which cells are there, by the position of their middle; all of them where the function is empty.
using Occupancy = std::function<bool(const Vector& middle)>;

Occupancy read_occupancy(JsonReader& reader, int gdim) {
  const json* value = reader.find("occupied");
  if (value == nullptr || *value == "all") {
    reader.record("occupied", "all");
    return {};
  }
  const std::string pointer = reader.pointer_to("occupied");
  if (!value->is_object() || !value->contains("ball"))
    raise("{}: found {}, expected \"all\" or {{\"ball\": {{\"radius\": r, \"center\": c}}}}", pointer, value->dump());
  JsonReader outer(*value, pointer);
  JsonReader ball(outer.at("ball"), outer.pointer_to("ball"));
  const double radius = ball.number("radius", 0.5);
  const std::array<double, 3> center = per_axis<double>(ball, "center", 0, gdim);
  ball.finish();
  outer.record("ball", ball.resolved());
  outer.finish();
  reader.record("occupied", outer.resolved());
  return [=](const Vector& middle) {
    return (middle - Eigen::Map<const Eigen::VectorXd>(center.data(), gdim)).norm() <= radius;
  };
}

}  // namespace

GridSource read_grid_source(const json& specification, const std::string& pointer, json& resolved) {
  JsonReader reader(specification, pointer);
  const auto gdim = small_integer(reader, "dimension", 3);
  if (gdim < 1 || gdim > 3) raise("{}: found {}, expected 1 to 3", reader.pointer_to("dimension"), gdim);
  const auto cells = per_axis<int>(reader, "cells", 8, gdim);
  const auto size = per_axis<double>(reader, "size", 1, gdim);
  const auto origin = per_axis<double>(reader, "origin", 0, gdim);
  const auto grading = per_axis<double>(reader, "grading", 1, gdim);
  for (int a = 0; a < gdim; ++a) {
    if (cells[a] < 1) raise("{}: found {}, expected at least 1", reader.pointer_to("cells"), cells[a]);
    if (!(size[a] > 0)) raise("{}: found {}, expected a length > 0", reader.pointer_to("size"), size[a]);
    if (!(grading[a] > 0)) raise("{}: found {}, expected a ratio > 0", reader.pointer_to("grading"), grading[a]);
  }
  const Occupancy occupied = read_occupancy(reader, gdim);
  reader.finish();
  resolved = reader.resolved();
  const auto make = [=](double refinement) {
    std::vector<GridAxis> axes;
    for (int a = 0; a < gdim; ++a)
      axes.push_back(make_axis(refined_count(cells[a], refinement), origin[a], size[a], grading[a]));
    Grid full(axes);
    if (!occupied) return full;
    std::vector<GridPlace> places;
    for (Index cell = 0; cell < full.num_cells(); ++cell) {
      const GridPlace place = full.cell_place(cell);
      Vector middle(gdim);
      for (int a = 0; a < gdim; ++a) middle[a] = 0.5 * (full.plane(a, place[a]) + full.plane(a, place[a] + 1));
      if (occupied(middle)) places.push_back(place);
    }
    return Grid(std::move(axes), places);
  };
  return {gdim, make};
}

Grid scaled(const Grid& grid, double factor) {
  std::vector<GridAxis> axes;
  for (int a = 0; a < grid.gdim(); ++a) {
    GridAxis axis = grid.axis(a);
    axis.origin *= factor;
    axis.spacing *= factor;
    for (double& plane : axis.planes) plane *= factor;
    axes.push_back(std::move(axis));
  }
  if (!grid.is_sparse()) return Grid(std::move(axes));
  std::vector<GridPlace> places(grid.num_cells());
  for (Index cell = 0; cell < grid.num_cells(); ++cell) places[cell] = grid.cell_place(cell);
  return Grid(std::move(axes), places);
}

}  // namespace halfgrad
