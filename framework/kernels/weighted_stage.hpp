// Points given by their weights (framework/weighted_points.hpp), from lines as in cell_polynomial.hpp, without scale.
#pragma once

#include "framework/types.hpp"

namespace halfgrad::kernels {

/// f = x_o + Σ a (x − x_o) + F c + Q : q over a point's entries, x_o the first of them.
template <class Scalar>
struct WeightedStage {
  int num_columns;
  int num_fours;               ///< of a line
  const Offset* first;         ///< [point] its first entry
  const Index* nodes;          ///< [entry]
  const Scalar* coefficients;  ///< [entry][four] a | c_1 … c_d | (q_11 …)
  const Scalar* lines;
  Scalar* out;  ///< [point][column]

  /// Points [begin, end) by the fastest instructions of this machine.
  void run(Index begin, Index end) const;
};

}  // namespace halfgrad::kernels
