// The one list of file formats: what is known by which extension, and what can be done with it.
#pragma once

#include <filesystem>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "framework/grid.hpp"
#include "framework/io/frame_sink.hpp"
#include "framework/io/frame_source.hpp"
#include "framework/io/geometry.hpp"

namespace halfgrad {

/// A file format; a null function is something that the format cannot do.
struct Format {
  std::string_view name;
  std::vector<std::string_view> extensions;  ///< lower case with the dot
  bool has_cells;                            ///< read() gives cells that make a mesh
  Geometry (*read)(const std::filesystem::path&);
  std::unique_ptr<FrameSource> (*open_frames)(const std::filesystem::path&);
  std::unique_ptr<FrameSink> (*create_frames)(const std::filesystem::path&, const PointSet&, const FrameSinkOptions&);
  Grid (*read_grid)(const std::filesystem::path&) = nullptr;  ///< the cells without listing them
};

const std::vector<Format>& formats();

/// What a caller wants of a format, for find_format.
enum class FormatUse { read_mesh, read_points, open_frames, create_frames };

/// The format of a path's extension, any case. Throws Error on an unknown extension, or one that does not serve the
/// use, and lists those that do.
const Format& find_format(const std::filesystem::path& path, FormatUse use);

}  // namespace halfgrad
