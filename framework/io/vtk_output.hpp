// Meshes and points with data, for ParaView and its kin.
#pragma once

#include <filesystem>
#include <span>

#include "framework/io/frame_sink.hpp"
#include "framework/mesh.hpp"

namespace halfgrad {

/// Writes a mesh with point data as .vtu (binary, doubles exact, atomically). Throws Error where an array has not one
/// row a vertex, or a name twice, and where the file cannot be written.
void write_vtu(const std::filesystem::path& path, const Mesh& mesh, std::span<const PointArray> arrays = {});

/// Writes points (#points × 2 or 3) with faces and point data as .vtp, likewise.
void write_vtp(const std::filesystem::path& path, const Points& points, const IndexTable& faces = {},
               std::span<const PointArray> arrays = {});

}  // namespace halfgrad
