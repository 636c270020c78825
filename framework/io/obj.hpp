// Wavefront OBJ (.obj).
#pragma once

#include <memory>

#include "framework/io/frame_sink.hpp"
#include "framework/io/geometry.hpp"

namespace halfgrad {

/// The vertices in order, the faces, and the text itself.
Geometry read_obj(const std::filesystem::path& path);

/// A sequence of files where the name has a %d, else one file. Lines of shape.obj_text other than "v" are repeated.
std::unique_ptr<FrameSink> create_obj_frames(const std::filesystem::path& path, const PointSet& shape,
                                             const FrameSinkOptions& options);

}  // namespace halfgrad
