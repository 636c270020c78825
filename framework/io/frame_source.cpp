#include "framework/io/frame_source.hpp"

#include "framework/error.hpp"

namespace halfgrad {

template <class Scalar>
void FrameSource::read_checked(Index frame, Values<Scalar>& out) {
  if (frame < 0 || frame >= num_frames_) raise("{}: frame {} asked for, there are {}", name_, frame, num_frames_);
  out.resize(num_vertices_, num_columns_);
  fill(frame, out);
  for (Eigen::Index v = 0; v < out.rows(); ++v)
    if (!out.row(v).allFinite())
      raise("{}: frame {}: vertex {} is not finite ({})", frame_name(frame), frame, v,
            fmt::join(out.row(v).begin(), out.row(v).end(), ", "));
}

void FrameSource::read(Index frame, Values<double>& out) { read_checked(frame, out); }
void FrameSource::read(Index frame, Values<float>& out) { read_checked(frame, out); }

void FrameSource::fill(Index frame, Values<float>& out) {
  buffer_.resize(num_vertices_, num_columns_);
  fill(frame, buffer_);
  out = buffer_.cast<float>();
}

}  // namespace halfgrad
