// Vertex gradients by universal kriging of the values around a vertex.
#pragma once

#include "framework/vertex_gradient_reconstructor.hpp"

namespace halfgrad {

/// Degree up to which polynomials are reproduced.
enum class KrigingDrift : std::uint8_t {
  quadratic,  ///< third order with Phong
  cubic       ///< larger patches; gives Hessians, fourth order with dual Taylor
};

/// Which patches the quadratic drift tries.
enum class KrigingPatch : std::uint8_t {
  wide,  ///< two rings and more: most accurate
  lean   ///< one ring where it suffices: fewest entries
};

struct KrigingOptions {
  KrigingDrift drift = KrigingDrift::quadratic;
  KrigingPatch patch = KrigingPatch::wide;  ///< the cubic drift has one schedule and takes no "lean"
};

/// Polynomial drift exactly, a Matérn-7/2 prior for the rest, on the nearest vertices of the rings around a vertex.
/// Exact for polynomials of the drift's degree wherever a patch determines them, boundary included; what it does not
/// determine is damped continuously. A vertex whose patch has next to no quadratic modes falls back to the
/// volume-weighted mean of its cells. The method and its constants are described in docs/kriging.md.
class Kriging final : public VertexGradientReconstructor {
 public:
  /// Throws Error for a cubic drift on lean patches.
  explicit Kriging(const KrigingOptions& options = {});
  Reconstruction reconstruct(const CellGradients& cells, std::span<const Index> vertices) const override;

 private:
  KrigingOptions options_;
};

}  // namespace halfgrad
