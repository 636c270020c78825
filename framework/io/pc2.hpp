// PC2 point caches (.pc2): a header of 32 bytes, then x y z as floats, all little-endian.
#pragma once

#include <filesystem>
#include <memory>

#include "framework/io/frame_sink.hpp"
#include "framework/io/frame_source.hpp"

namespace halfgrad {

std::unique_ptr<FrameSource> open_pc2_frames(const std::filesystem::path& path);
/// Points with two coordinates get z = 0.
std::unique_ptr<FrameSink> create_pc2_frames(const std::filesystem::path& path, const PointSet& shape,
                                             const FrameSinkOptions& options);

}  // namespace halfgrad
