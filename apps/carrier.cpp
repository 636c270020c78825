#include "apps/carrier.hpp"

#include <memory>
#include <set>

namespace halfgrad::app {

namespace {

template <class Scalar, class Bound>
Carrier<Scalar> carrier_of(const std::shared_ptr<const Bound>& bound) {
  Carrier<Scalar> carrier;
  carrier.report = bound->report();
  const auto workspace = std::make_shared<Workspace<Scalar>>();
  carrier.evaluate = [=](const Values<Scalar>& positions, Values<Scalar>& out, const EvaluateOptions& options) {
    bound->evaluate(positions, out, *workspace, options);
  };
  carrier.gradient = [=](const Values<Scalar>& positions) { return bound->gradient(positions); };
  return carrier;
}

template <class Scalar>
Carrier<Scalar> carrier_of(Interpolant<Scalar>&& interpolant) {
  const auto bound = std::make_shared<const Interpolant<Scalar>>(std::move(interpolant));
  Carrier<Scalar> carrier = carrier_of<Scalar>(bound);
  carrier.gdim = bound->gdim();
  carrier.evaluate_field = [=](const Values<Scalar>& values) { return bound->evaluate(values); };
  carrier.smooth_gradient = [=](const Values<Scalar>& positions) { return bound->smooth_gradient(positions); };
  carrier.num_linear_cells = [=](const Values<Scalar>& positions, const EvaluateOptions& options) {
    return bound->num_linear_cells(positions, options);
  };
  return carrier;
}

// The gradient near a surface is continuous as it is, and its points are always evaluated in full.
template <class Scalar>
Carrier<Scalar> carrier_of(SurfaceInterpolant<Scalar>&& interpolant) {
  const auto bound = std::make_shared<const SurfaceInterpolant<Scalar>>(std::move(interpolant));
  Carrier<Scalar> carrier = carrier_of<Scalar>(bound);
  carrier.gdim = 3;
  carrier.evaluate_field = [=](const Values<Scalar>& values) { return bound->evaluate_field(values); };
  carrier.smooth_gradient = carrier.gradient;
  carrier.num_linear_cells = [](const Values<Scalar>&, const EvaluateOptions&) { return Index{0}; };
  return carrier;
}

}  // namespace

template <class Scalar>
Carrier<Scalar> make_carrier(const Binding& binding, const InterpolationRule& rule) {
  const Reconstruction* given = binding.reconstruction ? &*binding.reconstruction : nullptr;
  if (binding.grid) return carrier_of(Interpolant<Scalar>(*binding.grid, binding.embedding, rule, given));
  if (binding.on_surface()) {
    Carrier<Scalar> carrier = carrier_of(SurfaceInterpolant<Scalar>(binding.mesh, binding.feet, rule, *given));
    // Weights name no cells; their feet do.
    const std::set<Index> cells(binding.feet.cells.begin(), binding.feet.cells.end());
    carrier.report.num_cells = binding.mesh.num_cells();
    carrier.report.num_active_cells = static_cast<Index>(cells.size());
    return carrier;
  }
  return carrier_of(Interpolant<Scalar>(binding.mesh, binding.embedding, rule, given));
}

template Carrier<float> make_carrier(const Binding&, const InterpolationRule&);
template Carrier<double> make_carrier(const Binding&, const InterpolationRule&);

}  // namespace halfgrad::app
