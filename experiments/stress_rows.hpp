// Every reconstructor on one mesh, with what is known of its rounding.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "framework/cell_gradients.hpp"
#include "framework/vertex_gradient_reconstructor.hpp"

namespace halfgrad {

/// A reconstructor under stress. Both conditions are factors on ε Σ|g||x|, from the way it computes its rows.
struct StressReconstructor {
  std::string name;  ///< as in configurations
  std::unique_ptr<VertexGradientReconstructor> reconstructor;
  double residual_condition = 1;  ///< of Σ_j (X_j − X_v) ⊗ g_vj = I
  double forward_condition = 1;   ///< of the weights themselves
  bool grids_only = false;        ///< refuses what is no grid of boxes
  double accepted_sum = 0;        ///< kriging: the greatest A1 of accepted rows; else 0
  bool is_mean = false;           ///< weights of cells are not negative
  bool blended_in = false;        ///< adaptive may take its gradients
};

/// All of the registry, kriging in its three forms.
const std::vector<StressReconstructor>& stress_reconstructors();

/// For each weight of a table the sum of the absolute values that it was computed from. A node's weight in a mean is a
/// sum over cells, and in each a difference of what the inverse Jacobian holds for all nodes.
std::vector<double> weight_magnitudes(const StressReconstructor& made, const CellGradients& cells,
                                      const GradientStencilTable& table);

}  // namespace halfgrad
