// What deform writes besides positions: one named array of the points a frame.
#pragma once

#include <memory>
#include <span>
#include <vector>

#include "apps/carrier.hpp"
#include "apps/deform.hpp"
#include "framework/io/field_source.hpp"
#include "framework/io/frame_sink.hpp"
#include "framework/io/frame_source.hpp"

namespace halfgrad::app {

/// The arrays that the options ask for. In a .pvd they stand with the points, else each in a sequence of its own,
/// "out.NAME.npy". Memory is kept from frame to frame.
template <class Scalar>
class Channels {
 public:
  /// Throws Error where the options ask for what the mesh, the frames or the surface do not give.
  Channels(const DeformOptions& options, const Binding& binding, const FrameSource& frames,
           const FrameSinkOptions& sink_options);
  ~Channels();

  /// Frames that an interrupted run of every sequence left, `most` at most.
  Index num_resumable(Index most) const;
  void resume(Index num_frames);
  /// Computes the arrays of the frame that was read last from its vertex positions; writes those that have their own
  /// sequence and returns the others, which stay as they are until the next call.
  std::span<const PointArray> carry(const Carrier<Scalar>& carrier, const Values<Scalar>& positions, Index frame);
  void finish();

 private:
  enum class Kind : std::uint8_t { gradient, stretch, normals, tangents, field };
  struct Channel;
  void add(std::string name, Kind kind, std::unique_ptr<FieldSource> field = nullptr);
  void add_directions(const DeformOptions& options, const Binding& binding, const FrameSource& frames);
  // The deformation gradients of this frame that directions are carried by.
  const Values<Scalar>& directing_gradient(const Carrier<Scalar>& carrier, const Values<Scalar>& positions);
  const Values<Scalar>& exact_gradient(const Carrier<Scalar>& carrier, const Values<Scalar>& positions);

  std::vector<Channel> channels_;
  bool smooth_ = false;
  std::string tangents_from_;       // the surface's array that the carried tangents replace
  Points normals_, tangents_;       // of the surface at rest, #points × 3 and × 4
  std::vector<PointArray> arrays_;  // of a .pvd: the surface's own, then those of the channels
  bool exact_is_known_ = false, smooth_is_known_ = false;
  Values<Scalar> exact_gradient_, smooth_gradient_;
};

}  // namespace halfgrad::app
