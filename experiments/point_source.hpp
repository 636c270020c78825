// The "points" of a configuration: where a mesh's interpolation is measured.
#pragma once

#include <filesystem>
#include <functional>
#include <nlohmann/json_fwd.hpp>
#include <string>

#include "framework/mesh.hpp"

namespace halfgrad {

/// Points, with faces where they are the vertices of a surface.
struct PointCloud {
  Points positions;  ///< #points × gdim
  IndexTable faces;  ///< polygons by point number; no rows for plain points
};

/// Makes the points for one level of a mesh.
using PointSource = std::function<PointCloud(const Mesh& mesh, int level)>;

/// From {"random": {…}}, {"grid": {…}}, {"geodesic": {…}}, {"cylinder": {…}}, {"tessellation": {…}} or {"file": name}.
/// Throws Error that names the JSON pointer.
PointSource read_point_source(const nlohmann::json& specification, const std::string& pointer,
                              const std::filesystem::path& directory, std::uint64_t seed, nlohmann::json& resolved);

/// Points uniform in the volume of a mesh (up to the variation of det J inside a cell), #count × gdim.
Points random_points(const Mesh& mesh, Index count, std::uint64_t seed);

/// The geodesic sphere of 10·frequency² + 2 vertices: an icosahedron with each edge cut into `frequency` parts.
PointCloud geodesic_sphere(int frequency, double radius, const Vector& center);

/// A closed cylinder around the third axis: `around` × (`along` + 1) vertices on the side and two at the poles.
PointCloud cylinder_surface(double radius, double height, int around, int along, const Vector& center);

}  // namespace halfgrad
