// ParaView collections (.pvd): a list of files with their times.
#pragma once

#include <filesystem>
#include <memory>

#include "framework/io/frame_sink.hpp"
#include "framework/io/frame_source.hpp"

namespace halfgrad {

std::unique_ptr<FrameSource> open_pvd_frames(const std::filesystem::path& path);
/// Writes name_0000.vtp, … beside name.pvd; frame numbers are the times.
std::unique_ptr<FrameSink> create_pvd_frames(const std::filesystem::path& path, const PointSet& shape,
                                             const FrameSinkOptions& options);

}  // namespace halfgrad
