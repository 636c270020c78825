// What deform writes besides positions: one named array of the points a frame.
#pragma once

#include <memory>
#include <vector>

#include "apps/carrier.hpp"
#include "apps/deform.hpp"
#include "framework/io/frame_sink.hpp"
#include "framework/io/frame_source.hpp"

namespace halfgrad::app {

/// The arrays that the options ask for. In a .pvd they stand with the points, else each in a sequence of its own,
/// "out.NAME.npy".
class Channels {
 public:
  /// Throws Error where the options ask for what the mesh, the frames or the surface do not give.
  Channels(const DeformOptions& options, const Binding& binding, const FrameSource& frames,
           const FrameSinkOptions& sink_options);
  ~Channels();

  /// Frames that an interrupted run of every sequence left, `most` at most.
  Index num_resumable(Index most) const;
  void resume(Index num_frames);
  /// Computes the arrays of a frame from its vertex positions; writes those that have their own sequence and returns
  /// the others.
  template <class Scalar>
  std::vector<PointArray> carry(const Carrier<Scalar>& carrier, const Values<Scalar>& positions, Index frame);
  void finish();

 private:
  struct Channel;
  std::vector<std::unique_ptr<Channel>> channels_;
  Points normals_;  // of the surface at rest, #points × 3
  std::vector<PointArray> constant_;
};

}  // namespace halfgrad::app
