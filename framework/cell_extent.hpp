// How large a cell is along the axes, and what it means that it has no volume.
#pragma once

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstdint>

#include "elements/element.hpp"

namespace halfgrad {

/// Extent of a cell's nodes (num_nodes × dim) along each axis, dim × 1.
template <Element E>
ReferencePoint<E> cell_extent(const NodeMatrix<E>& positions) {
  ReferencePoint<E> extent;
  for (int a = 0; a < E::dim; ++a) extent[a] = positions.col(a).maxCoeff() - positions.col(a).minCoeff();
  return extent;
}

/// The one definition of a cell without volume, for reports, gradients and locations alike: at the element's center
/// |det ∂x/∂ξ| ≤ 1e-14 times the product of the extents along the axes. Stretching along the axes does not change it,
/// so that a needle of 1e8 to 1 along an axis is a good cell; one that is oblique to the axes is good up to about 1e6
/// to 1, beyond which rounding of its coordinates would make its volume.
template <Element E>
bool is_degenerate(const ReferencePoint<E>& extent, double center_determinant) {
  return !(std::abs(center_determinant) > 1e-14 * extent.prod());
}

/// The power of two that brings an extent into [½, 1), exactly; 1 for an extent of zero.
inline double unit_scale(double extent) {
  constexpr int exponent_bits = 52, bias = 1023;
  const auto exponent = static_cast<std::int64_t>(std::bit_cast<std::uint64_t>(extent) >> exponent_bits);
  if (exponent == 0) return 1;
  // 2^(exponent − bias) ≤ extent < 2^(exponent − bias + 1)
  const std::int64_t inverse = std::max<std::int64_t>(1, 2 * bias - 1 - exponent);
  return std::bit_cast<double>(static_cast<std::uint64_t>(inverse) << exponent_bits);
}

}  // namespace halfgrad
