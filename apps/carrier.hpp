// What carries points, whatever they are bound to.
#pragma once

#include <functional>

#include "apps/binding.hpp"
#include "framework/interpolant.hpp"

namespace halfgrad::app {

/// An interpolant of a mesh, of a grid or of a surface, or a baseline, as functions of the vertices' positions or other
/// data. Baselines have no gradients, and no cells that could be linear.
template <class Scalar>
struct Carrier {
  BindReport report;
  int gdim = 0;
  std::function<void(const Values<Scalar>& positions, Values<Scalar>& out, const EvaluateOptions&)> evaluate;
  std::function<void(const Values<Scalar>& values, Values<Scalar>& out)> evaluate_field;
  std::function<Values<Scalar>(const Values<Scalar>&positions)> gradient, smooth_gradient;
  std::function<Index(const Values<Scalar>& positions, const EvaluateOptions&)> num_linear_cells;
};

/// Binds for frames. One thread at a time may evaluate.
template <class Scalar>
Carrier<Scalar> make_carrier(const Binding& binding, const InterpolationRule& rule);

}  // namespace halfgrad::app
