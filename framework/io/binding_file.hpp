// Bindings on disk (.hgb): what locating and reconstructing gave, so that later runs need neither.
#pragma once

#include <filesystem>
#include <optional>
#include <string>

#include "framework/embedding.hpp"
#include "framework/gradient_stencils.hpp"

namespace halfgrad {

/// A binding and what it belongs to.
struct SavedBinding {
  std::string settings;     ///< JSON object: whatever the writer wants back
  std::string fingerprint;  ///< of the rest mesh and the points, Fingerprint::text()
  Embedding embedding;
  std::optional<Reconstruction> reconstruction;
};

/// Writes a binding, atomically: CBOR with the tables as byte strings, all numbers exact. Throws Error where the file
/// cannot be written.
void write_binding(const std::filesystem::path& path, const SavedBinding& binding);

/// Reads a binding for `mesh` and a number of points. Throws Error where the file is no binding or one of another
/// version, where `fingerprint` (of the mesh and the points at hand) is not the one it was made for, and where its
/// tables name cells or vertices that the mesh has not.
SavedBinding read_binding(const std::filesystem::path& path, const Mesh& mesh, Index num_points,
                          const std::string& fingerprint);

/// The settings alone.
std::string read_binding_settings(const std::filesystem::path& path);

}  // namespace halfgrad
