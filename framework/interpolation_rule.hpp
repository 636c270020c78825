// Which formula turns vertex data into the value at a point.
#pragma once

#include <cstdint>
#include <span>
#include <string_view>

namespace halfgrad {

/// How vertex data become the value at a point. All but dual_taylor have the form f = Σ_i a_i x_i + F_i c_i.
enum class Formula : std::uint8_t {
  blend,  ///< Σ β_i (x_i + α F_i (X − X_i)): linear (α = 0), Phong (½), vertex blend (1); James 2020, Eq. 11–13, 19
  hermite,      ///< cubic along edges from the same data
  dual_taylor,  ///< Σ β_i (x_i + ⅔ F_i d_i + ⅙ d_iᵀ Q_i d_i): order four; Kraaijpoel & van Leeuwen 2010
  quadratic10   ///< quadratic with Hermite midpoints, James 2020, Eq. 20–23: equals Phong; simplices only
};

/// An interpolant: a formula and its parameter.
struct InterpolationRule {
  Formula formula = Formula::blend;
  double alpha = 0.5;  ///< of blend

  bool needs_gradients() const { return formula != Formula::blend || alpha != 0; }
  bool needs_hessians() const { return formula == Formula::dual_taylor; }
};

/// A named interpolant with its default parameter.
struct NamedRule {
  std::string_view name;
  InterpolationRule rule;
  std::string_view summary;  ///< one line
};

/// The named interpolants, in the order reports list them.
std::span<const NamedRule> named_rules();

/// The rule of a name; throws Error that lists the known names.
InterpolationRule named_rule(std::string_view name);

}  // namespace halfgrad
