// Frames that are one mesh or point file each.
#pragma once

#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include "framework/io/frame_source.hpp"

namespace halfgrad {

/// Frames from files in this order, at least one; see open_frames for displacements. `name` is for messages.
std::unique_ptr<FrameSource> open_frame_files(const std::string& name, std::vector<std::filesystem::path> files);

}  // namespace halfgrad
