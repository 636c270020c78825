// Points to be carried, with what their file says besides.
#pragma once

#include <filesystem>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "framework/mesh.hpp"

namespace halfgrad {

/// Named values at points or vertices, #points × #columns.
struct PointArray {
  std::string name;
  Values<double> values;
};

/// The array of this name, or null.
const PointArray* find_array(std::span<const PointArray> arrays, std::string_view name);
/// The first array whose name is one of these but for case, spaces and underscores, or null.
const PointArray* find_array_like(std::span<const PointArray> arrays, std::span<const std::string_view> names);

/// Points of a file, in its order and count.
struct PointSet {
  Points points;                   ///< #points × 2 or 3
  IndexTable faces;                ///< polygons by point number; no rows where the file has none
  std::vector<PointArray> arrays;  ///< the point data of a VTK file; of PLY texture coordinates as "uv"
  /// Texture coordinates of each entry of `faces`, v upwards: #corners × 2, NaN where a corner has none; no rows where
  /// the file has none. Of OBJ "vt"; else the point data "uv", "TCoords", "Texture Coordinates" or "TEXCOORD_0".
  Points corner_uv = Points(0, 2);
  std::string obj_text;  ///< the whole text of an OBJ file, which OBJ output repeats but for its "v" lines
};

/// Reads .obj, .ply, .stl (three points a facet, in file order), .vtk, .vtp, .vtu, .npy (#points × 2|3) and, as their
/// vertices, the mesh formats. Throws Error, naming the file and the line, byte or point, on anything unreadable and on
/// non-finite coordinates.
PointSet read_points(const std::filesystem::path& path);

/// The points with gdim coordinates: z is dropped where it is constant (relative to the largest coordinate, 1e-12).
/// Throws Error where it is not, or where there are fewer coordinates than gdim. `name` is for the message.
Points in_dimension(const Points& points, int gdim, const std::string& name);

}  // namespace halfgrad
