#include "experiments/scene.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>
#include <set>

#include "framework/boundary_facets.hpp"

namespace halfgrad {

using nlohmann::json;

namespace {

constexpr std::size_t most_bytes = 22'000'000;  // before base64, which adds a third
constexpr std::uint16_t not_found = 65535;

std::string base64(const unsigned char* bytes, std::size_t count) {
  constexpr char letters[] = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  std::string text;
  text.reserve((count + 2) / 3 * 4);
  for (std::size_t i = 0; i < count; i += 3) {
    const unsigned rest = count - i > 1 ? bytes[i + 1] : 0, last = count - i > 2 ? bytes[i + 2] : 0;
    const unsigned word = static_cast<unsigned>(bytes[i]) << 16 | rest << 8 | last;
    text += letters[word >> 18];
    text += letters[word >> 12 & 63];
    text += count - i > 1 ? letters[word >> 6 & 63] : '=';
    text += count - i > 2 ? letters[word & 63] : '=';
  }
  return text;
}

template <class Number>
json encoded(const char* type, const std::vector<Number>& numbers) {
  return {{"type", type},
          {"data", base64(reinterpret_cast<const unsigned char*>(numbers.data()), numbers.size() * sizeof(Number))}};
}

/// Positions, #points × #columns, as steps of 1/65534 of their bounding box.
json encoded_positions(const Points& points) {
  std::vector<double> low(points.cols(), 0), step(points.cols(), 0);
  for (Eigen::Index c = 0; c < points.cols(); ++c) {
    double least = HUGE_VAL, greatest = -HUGE_VAL;
    for (Eigen::Index p = 0; p < points.rows(); ++p) {
      if (!std::isfinite(points(p, c))) continue;
      least = std::min(least, points(p, c));
      greatest = std::max(greatest, points(p, c));
    }
    if (!(least <= greatest)) continue;
    low[c] = least;
    step[c] = (greatest - least) / (not_found - 1);
  }
  std::vector<std::uint16_t> steps(points.size());
  for (Eigen::Index p = 0; p < points.rows(); ++p)
    for (Eigen::Index c = 0; c < points.cols(); ++c) {
      const double value = points(p, c);
      steps[p * points.cols() + c] = !std::isfinite(value) ? not_found
                                     : step[c] > 0 ? static_cast<std::uint16_t>(std::lround((value - low[c]) / step[c]))
                                                   : 0;
    }
  json array = encoded("u2", steps);
  array["low"] = low;
  array["step"] = step;
  return array;
}

/// Vertex pairs: of bodies in space the edges of the boundary, of others those of every cell.
std::vector<std::uint32_t> coarse_edges(const Mesh& mesh) {
  std::set<std::pair<Index, Index>> edges;
  const auto add = [&](Index a, Index b) { edges.emplace(std::min(a, b), std::max(a, b)); };
  if (mesh.gdim() == 3 && !mesh.is_surface()) {
    for (const CellFacet& side : boundary_facets(mesh, std::vector<char>(mesh.num_cells(), 0)))
      with_cell(mesh, side.cell, [&]<Element E>(const ElementBlock<E>& block, Eigen::Index row) {
        const Facet& facet = E::facets[side.facet];
        for (int i = 0; i < facet.num_nodes; ++i)
          add(block.cells(row, facet.nodes[i]), block.cells(row, facet.nodes[(i + 1) % facet.num_nodes]));
      });
  } else {
    for_each_block(mesh, [&]<Element E>(const ElementBlock<E>& block, Index) {
      for (Eigen::Index row = 0; row < block.cells.rows(); ++row)
        for (const Facet& facet : E::facets) {
          if (E::dim == 2) add(block.cells(row, facet.nodes[0]), block.cells(row, facet.nodes[1]));
          if (E::dim == 1) add(block.cells(row, 0), block.cells(row, 1));
        }
    });
  }
  std::vector<std::uint32_t> pairs;
  for (const auto& [a, b] : edges) {
    pairs.push_back(static_cast<std::uint32_t>(a));
    pairs.push_back(static_cast<std::uint32_t>(b));
  }
  return pairs;
}

std::vector<std::uint32_t> triangles(const IndexTable& faces) {
  std::vector<std::uint32_t> corners;
  for (Index f = 0; f < faces.num_rows(); ++f) {
    const std::span<const Index> face = faces[f];
    for (std::size_t i = 1; i + 1 < face.size(); ++i)
      for (const std::size_t corner : {std::size_t{0}, i, i + 1})
        corners.push_back(static_cast<std::uint32_t>(face[corner]));
  }
  return corners;
}

}  // namespace

SceneRecorder::SceneRecorder(const Mesh& mesh, const PointCloud& cloud, std::size_t num_frames, std::size_t num_rules)
    : scene_(std::make_unique<json>(json::object())), wanted_(num_frames, 1) {
  if (mesh.gdim() > 3) {
    is_omitted_ = true;
    (*scene_)["omitted"] = fmt::format("There is no view of {} dimensions.", mesh.gdim());
    return;
  }
  // 16-bit coordinates and a float error a rule, coordinates of the truth and of the vertices.
  const auto bytes = [&](std::size_t points) {
    return points * (num_rules * 10 + 6) + static_cast<std::size_t>(mesh.num_vertices()) * 6;
  };
  std::size_t points = static_cast<std::size_t>(cloud.positions.rows());
  std::string note;
  if (cloud.faces.num_rows() == 0 && bytes(points) > most_bytes / 2) {
    point_stride_ = static_cast<Eigen::Index>(2 * bytes(points) / most_bytes + 1);
    points /= static_cast<std::size_t>(point_stride_);
    note = fmt::format("The view and the histogram show every {}th point.", point_stride_);
  }
  if (bytes(points) > most_bytes) {
    is_omitted_ = true;
    (*scene_)["omitted"] = fmt::format(
        "The 3D view is left out: {} points under {} rules would make the page too large. Fewer rules make room.",
        points, num_rules);
    return;
  }
  const std::size_t kept = std::clamp<std::size_t>(most_bytes / bytes(points), 1, num_frames);
  if (kept < num_frames) {
    std::fill(wanted_.begin(), wanted_.end(), 0);
    for (std::size_t k = 1; k <= kept; ++k) wanted_[k * num_frames / kept - 1] = 1;
    note += fmt::format("{}The slider has {} of the {} frames.", note.empty() ? "" : " ", kept, num_frames);
  }
  *scene_ = {
      {"gdim", mesh.gdim()},
      {"columns", mesh.gdim()},
      {"edges", encoded("u4", coarse_edges(mesh))},
      {"faces", encoded("u4", triangles(cloud.faces))},
      {"rest",
       {{"vertices", encoded_positions(mesh.vertices())}, {"points", encoded_positions(selected(cloud.positions))}}},
      {"frames", json::array()},
      {"rules", json::array()},
      {"note", note}};
  for (std::size_t r = 0; r < num_rules; ++r)
    (*scene_)["rules"].push_back({{"positions", json::array()}, {"errors", json::array()}});
}

SceneRecorder::~SceneRecorder() = default;
SceneRecorder::SceneRecorder(SceneRecorder&&) noexcept = default;

Points SceneRecorder::selected(const Points& points) const {
  if (point_stride_ == 1) return points;
  Points some((points.rows() + point_stride_ - 1) / point_stride_, points.cols());
  for (Eigen::Index p = 0; p < some.rows(); ++p) some.row(p) = points.row(p * point_stride_);
  return some;
}

bool SceneRecorder::wants(std::size_t f) const { return !is_omitted_ && wanted_[f] != 0; }

void SceneRecorder::add(int number, const Points& values, const Points& truth, std::span<const Points> results) {
  json& scene = *scene_;
  scene["columns"] = truth.cols();
  scene["frames"].push_back(
      {{"number", number}, {"vertices", encoded_positions(values)}, {"truth", encoded_positions(selected(truth))}});
  for (std::size_t r = 0; r < results.size(); ++r) {
    scene["rules"][r]["positions"].push_back(encoded_positions(selected(results[r])));
    const Eigen::VectorXd error = (results[r] - truth).rowwise().norm();
    std::vector<float> errors;
    for (Eigen::Index p = 0; p < error.size(); p += point_stride_) errors.push_back(static_cast<float>(error[p]));
    scene["rules"][r]["errors"].push_back(encoded("f4", errors));
  }
}

std::string SceneRecorder::text() const { return scene_->dump(); }

}  // namespace halfgrad
