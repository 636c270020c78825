// Deformations with known values, gradients and Hessians.
#pragma once

#include <array>
#include <memory>
#include <nlohmann/json_fwd.hpp>
#include <span>
#include <string>
#include <string_view>

#include "framework/json_reader.hpp"
#include "framework/types.hpp"

namespace halfgrad {

/// Value and derivatives of a field at one position.
struct FieldJet {
  Vector value;                               ///< gdim
  SmallMatrix gradient;                       ///< gdim × gdim, row = component, column = axis
  std::array<SmallMatrix, max_gdim> hessian;  ///< one gdim × gdim matrix a component
};

/// A smooth map x = f(X) of space into itself. Const and thread-safe.
class Field {
 public:
  virtual ~Field() = default;
  /// f(X); X has gdim entries.
  virtual Vector value(const Vector& position) const = 0;
  /// f, ∇f and ∇²f at X, exact to round-off.
  virtual FieldJet jet(const Vector& position) const = 0;
};

/// What a field is made for.
struct FieldSetting {
  int gdim = 3;
  std::uint64_t seed = 0;  ///< of random coefficients
};

/// One row of the registry.
struct FieldEntry {
  std::string_view name;
  std::string_view summary;  ///< one line: the formula
  std::unique_ptr<Field> (*make)(JsonReader& options, const FieldSetting& setting);
};

/// All fields, in the order reports list them.
std::span<const FieldEntry> field_registry();

/// From "name" or {"name": {options}}; `resolved`, where given, receives {"name": {options with defaults}}. Throws
/// Error with the known names or keys.
std::unique_ptr<Field> make_field(const nlohmann::json& specification, const std::string& pointer,
                                  const FieldSetting& setting, nlohmann::json* resolved = nullptr);

/// f at each position, #positions × gdim.
Points field_values(const Field& field, const Points& positions);

}  // namespace halfgrad
