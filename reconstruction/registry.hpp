// The one list of reconstructors: the command line, configs, error texts and tests derive from it.
#pragma once

#include <memory>
#include <nlohmann/json_fwd.hpp>
#include <span>
#include <string>
#include <string_view>

#include "framework/json_reader.hpp"
#include "framework/vertex_gradient_reconstructor.hpp"

namespace halfgrad {

/// One row of the registry.
struct ReconstructorEntry {
  std::string_view name;
  std::string_view summary;  ///< one line: the rule
  /// Makes the reconstructor from its options; the caller checks for unknown keys.
  std::unique_ptr<VertexGradientReconstructor> (*make)(JsonReader& options);
};

/// All reconstructors, in the order reports list them. `exact` is not among them: it takes a field, not a mesh.
std::span<const ReconstructorEntry> reconstructor_registry();

/// A reconstructor with the options it was made from, defaults filled in.
struct MadeReconstructor {
  std::string name;
  std::string options;  ///< compact JSON object, "{}" where there are none
  std::unique_ptr<VertexGradientReconstructor> reconstructor;
};

/// From "name" or {"name": {options}}; `pointer` says where the specification stands, and `further` lists
/// reconstructors of the caller's own. Throws Error with the known names or keys.
MadeReconstructor make_reconstructor(const nlohmann::json& specification, const std::string& pointer = "",
                                     std::span<const ReconstructorEntry> further = {});

}  // namespace halfgrad
