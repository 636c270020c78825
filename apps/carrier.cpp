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
  // Fields have other widths than positions, and so other memory.
  const auto workspace = std::make_shared<Workspace<Scalar>>();
  carrier.evaluate_field = [=](const Values<Scalar>& values, Values<Scalar>& out) {
    bound->evaluate(values, out, *workspace);
  };
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
  carrier.evaluate_field = [=](const Values<Scalar>& values, Values<Scalar>& out) {
    out = bound->evaluate_field(values);
  };
  carrier.smooth_gradient = carrier.gradient;
  carrier.num_linear_cells = [](const Values<Scalar>&, const EvaluateOptions&) { return Index{0}; };
  return carrier;
}

template <class Scalar>
Carrier<Scalar> carrier_of(const Mesh& mesh, const std::shared_ptr<const ScatteredTransfer>& transfer) {
  Carrier<Scalar> carrier;
  carrier.gdim = mesh.gdim();
  carrier.evaluate = [=](const Values<Scalar>& positions, Values<Scalar>& out, const EvaluateOptions&) {
    transfer->evaluate(positions, out);
  };
  carrier.evaluate_field = [=](const Values<Scalar>& values, Values<Scalar>& out) {
    transfer->evaluate_field(values, out);
  };
  const auto& matrix = transfer->matrix();
  const std::set<int> active(matrix.innerIndexPtr(), matrix.innerIndexPtr() + matrix.nonZeros());
  carrier.report.num_points = static_cast<Index>(matrix.rows());
  carrier.report.num_vertices = static_cast<Index>(matrix.cols());
  carrier.report.num_active_vertices = static_cast<Index>(active.size());
  carrier.report.num_cells = mesh.num_cells();
  carrier.report.bytes = matrix.nonZeros() * static_cast<Offset>(sizeof(double) + sizeof(int));
  return carrier;
}

}  // namespace

template <class Scalar>
Carrier<Scalar> make_carrier(const Binding& binding, const InterpolationRule& rule) {
  if (binding.by_vertices) return carrier_of<Scalar>(binding.mesh, binding.transfer);
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
