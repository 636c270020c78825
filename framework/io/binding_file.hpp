// Bindings on disk (.hgb): what locating and reconstructing gave, so that later runs need neither.
#pragma once

#include <Eigen/SparseCore>
#include <filesystem>
#include <optional>
#include <string>
#include <variant>

#include "framework/embedding.hpp"
#include "framework/gradient_stencils.hpp"
#include "framework/surface.hpp"

namespace halfgrad {

/// Where points lie: in the cells of a mesh or a grid; at their feet on a surface; or by weights on vertices alone,
/// #points × #vertices.
using Places = std::variant<Embedding, SurfaceEmbedding, Eigen::SparseMatrix<double, Eigen::RowMajor>>;

/// A binding and what it belongs to.
struct SavedBinding {
  std::string settings;     ///< JSON object: whatever the writer wants back
  std::string fingerprint;  ///< of the rest mesh and the points, Fingerprint::text()
  Places places;
  std::optional<Reconstruction> reconstruction;
};

/// Sizes that a binding must agree with.
struct BindingSizes {
  int gdim = 0;
  Index num_vertices = 0, num_cells = 0, num_points = 0;
};

/// Writes a binding, atomically: CBOR with the tables as byte strings, all numbers exact. Throws Error where the file
/// cannot be written.
void write_binding(const std::filesystem::path& path, const SavedBinding& binding);

/// Reads a binding for a rest shape and points. Throws Error where the file is no binding or one of another version,
/// where `fingerprint` (of the shape and the points at hand) is not the one it was made for, and where its tables name
/// cells or vertices beyond `sizes`. Feet come without their points (SurfaceEmbedding::points).
SavedBinding read_binding(const std::filesystem::path& path, const BindingSizes& sizes, const std::string& fingerprint);

/// The settings alone.
std::string read_binding_settings(const std::filesystem::path& path);

}  // namespace halfgrad
