// The margins of points in a simplex, several points at once: the inner loop of point location.
#pragma once

#include <array>

namespace halfgrad {

/// Number of points in one call of plane_margins.
inline constexpr int num_lanes = 8;

/// The weights of a simplex as planes: β_i = at_first_i + gradient_i · (X − first).
template <int D>
struct WeightPlanes {
  std::array<std::array<double, D>, D + 1> gradient;
  std::array<double, D + 1> at_first;
  std::array<double, D> first;
};

/// The least weight of num_lanes points, given as num_lanes values a coordinate. The operations and their order are the
/// same for every instruction set, without fused multiply-adds, and so are the bits of the result.
void plane_margins(const WeightPlanes<1>& planes, const std::array<const double*, 1>& x, double* margins);
void plane_margins(const WeightPlanes<2>& planes, const std::array<const double*, 2>& x, double* margins);
void plane_margins(const WeightPlanes<3>& planes, const std::array<const double*, 3>& x, double* margins);

}  // namespace halfgrad
