// Which points of some ranges a simplex holds, several points at once: the inner loop of point location.
#pragma once

#include <array>
#include <span>

#include "framework/types.hpp"

namespace halfgrad {

/// Numbers by which the arrays of a PlaneTest are longer than their content: vectors are read whole.
inline constexpr int max_lanes = 8;

/// The weights of a simplex as planes: β_i = at_first_i + gradient_i · (X − first).
template <int D>
struct WeightPlanes {
  std::array<std::array<double, D>, D + 1> gradient;
  std::array<double, D + 1> at_first;
  std::array<double, D> first;
};

/// A simplex against points, which are an array a coordinate.
template <int D>
struct PlaneTest {
  WeightPlanes<D> planes;
  double least;                    ///< the least weight of a point that the simplex holds
  std::array<const double*, D> x;  ///< [point]
  double* margin;                  ///< [point] the greatest least weight of any simplex so far
};

/// A range of points.
struct PointRange {
  Index begin, end;
};

/// Raises margin[p] to the point's least weight where that is at least `least` and greater than margin[p]. Writes the
/// points raised to `raised`, which has room for all points of the ranges, and returns their number. The operations and
/// their order are the same for every instruction set, without fused multiply-adds, and so are the bits of the result.
Index raise_margins(const PlaneTest<1>& test, std::span<const PointRange> ranges, Index* raised);
Index raise_margins(const PlaneTest<2>& test, std::span<const PointRange> ranges, Index* raised);
Index raise_margins(const PlaneTest<3>& test, std::span<const PointRange> ranges, Index* raised);

}  // namespace halfgrad
