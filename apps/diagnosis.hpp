// What is wrong or notable in the input of a binding: counted under fixed names, reported, refused beyond a limit.
#pragma once

#include <filesystem>
#include <nlohmann/json_fwd.hpp>
#include <string>
#include <string_view>
#include <vector>

#include "framework/embedding.hpp"
#include "framework/gradient_stencils.hpp"

namespace halfgrad::app {

/// A kind of fault and what of it was found.
struct Fault {
  std::string_view name;                  ///< "inverted_cells"
  double amount = 0;                      ///< how many; of outside_distance the greatest, length units
  std::vector<std::vector<Index>> first;  ///< up to ten: a cell, vertex or point each, or the vertices of a facet
};

/// All faults of a mesh, those that it has not too, with amount zero; `report` is inspect(mesh).
std::vector<Fault> mesh_faults(const Mesh& mesh, const MeshReport& report);
/// Points outside, and the distance of the farthest.
std::vector<Fault> point_faults(const Embedding& embedding);
/// Vertices whose stencil is not the one asked for.
std::vector<Fault> gradient_faults(const GradientStencilTable& table);

/// How much of each fault is accepted: any amount unless a limit is named.
class Limits {
 public:
  /// Texts NAME=NUMBER, of one name the last. Throws Error on an unknown name and on what is no number from zero.
  explicit Limits(const std::vector<std::string>& texts = {});
  /// Throws Error, with the name, the amount and the first, where a fault exceeds its limit.
  void check(const std::filesystem::path& file, const std::vector<Fault>& faults) const;

 private:
  std::vector<double> most_;  // one for each kind
};

/// {"inverted_cells": {"count": 3, "first": [17, 20, 21]}, …}; faults that are no counts are numbers.
nlohmann::ordered_json to_json(const std::vector<Fault>& faults);

/// {"full_fit": 120, …}: how many rows each rule served.
nlohmann::ordered_json rule_counts(const GradientStencilTable& table);
/// {"wider_patch": [3, 17], …}: the vertices that neither the average nor the full fit served.
nlohmann::ordered_json vertices_by_rule(const GradientStencilTable& table);

/// The names that --limit takes.
std::vector<std::string_view> fault_names();

/// The lines that `info` and `bind` print of the faults that were found.
std::string fault_lines(const std::vector<Fault>& faults);

}  // namespace halfgrad::app
