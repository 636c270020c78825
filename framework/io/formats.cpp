#include "framework/io/formats.hpp"

#include <algorithm>
#include <cctype>

#include "framework/error.hpp"
#include "framework/io/gmsh.hpp"
#include "framework/io/medit.hpp"
#include "framework/io/npy.hpp"
#include "framework/io/obj.hpp"
#include "framework/io/pc2.hpp"
#include "framework/io/ply.hpp"
#include "framework/io/pvd.hpp"
#include "framework/io/stl.hpp"
#include "framework/io/tetgen.hpp"
#include "framework/io/vtk_grid.hpp"
#include "framework/io/vtk_legacy.hpp"
#include "framework/io/vtk_xml.hpp"
#include "framework/json_reader.hpp"

namespace halfgrad {

namespace {

bool serves(const Format& format, FormatUse use) {
  switch (use) {
    case FormatUse::read_mesh:
      return format.has_cells;
    case FormatUse::read_points:
      return format.read != nullptr;
    case FormatUse::open_frames:
      return format.read != nullptr || format.open_frames != nullptr;
    case FormatUse::create_frames:
      return format.create_frames != nullptr;
  }
  return false;
}

std::string_view verb(FormatUse use) {
  switch (use) {
    case FormatUse::read_mesh:
      return "meshes are read from";
    case FormatUse::read_points:
      return "points are read from";
    case FormatUse::open_frames:
      return "frames are read from";
    case FormatUse::create_frames:
      return "frames are written as";
  }
  return "";
}

}  // namespace

const std::vector<Format>& formats() {
  static const std::vector<Format> table = {
      {"Gmsh", {".msh"}, true, read_gmsh, nullptr, nullptr},
      {"legacy VTK", {".vtk"}, true, read_vtk_legacy, nullptr, nullptr},
      {"VTK XML", {".vtu", ".vtp", ".pvtu"}, true, read_vtk_xml, nullptr, nullptr},
      {"VTK grid", {".vti", ".vtr"}, true, read_vtk_grid_cells, nullptr, nullptr, read_vtk_grid},
      {"MEDIT", {".mesh"}, true, read_medit, nullptr, nullptr},
      {"TetGen", {".node", ".ele"}, true, read_tetgen, nullptr, nullptr},
      {"Wavefront OBJ", {".obj"}, true, read_obj, nullptr, create_obj_frames},
      {"PLY", {".ply"}, true, read_ply, nullptr, nullptr},
      {"STL", {".stl"}, false, read_stl, nullptr, nullptr},
      {"NumPy", {".npy"}, false, read_npy_geometry, open_npy_frames, create_npy_frames},
      {"PC2 point cache", {".pc2"}, false, nullptr, open_pc2_frames, create_pc2_frames},
      {"ParaView collection", {".pvd"}, false, nullptr, open_pvd_frames, create_pvd_frames},
  };
  return table;
}

const Format& find_format(const std::filesystem::path& path, FormatUse use) {
  std::string extension = path.extension().string();
  std::transform(extension.begin(), extension.end(), extension.begin(),
                 [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  std::vector<std::string_view> serving;
  std::string_view known_as;
  for (const Format& format : formats()) {
    const bool named =
        std::find(format.extensions.begin(), format.extensions.end(), extension) != format.extensions.end();
    if (named && serves(format, use)) return format;
    if (named) known_as = format.name;
    if (serves(format, use)) serving.insert(serving.end(), format.extensions.begin(), format.extensions.end());
  }
  if (std::error_code ignored; use != FormatUse::create_frames && std::filesystem::is_directory(path, ignored))
    raise("{}: found a folder, expected a file{}", path.string(),
          use == FormatUse::open_frames
              ? fmt::format(" or a pattern of its files such as {}", (path / "*.vtu").string())
              : "");
  const std::string nearest = nearest_name(extension, serving);
  const std::string found = !known_as.empty()   ? fmt::format("{} ({})", extension, known_as)
                            : extension.empty() ? "a name without extension"
                                                : fmt::format("the unknown extension {}", extension);
  // .inp is no misspelt .vtp: only names that begin alike are taken for mistakes.
  const bool alike = known_as.empty() && extension.size() > 1 && nearest.size() > 1 && extension[1] == nearest[1];
  const bool foreign = known_as.empty() && !extension.empty() && !alike && use != FormatUse::create_frames;
  raise("{}: found {}, but {} {}{}{}", path.string(), found, verb(use), join_names(serving),
        alike ? fmt::format("; did you mean {}?", nearest) : "",
        foreign ? "; meshio (\"meshio convert FILE out.vtu\") turns many other formats into one of them" : "");
}

std::unique_ptr<FrameSink> create_frames(const std::filesystem::path& path, const PointSet& shape,
                                         const FrameSinkOptions& options) {
  const Format& format = find_format(path, FormatUse::create_frames);
  // Before the first frame is computed, and by the name that the caller gave.
  std::error_code ignored;
  if (const std::filesystem::path folder = path.parent_path();
      !folder.empty() && !std::filesystem::exists(folder, ignored))
    raise("{}: cannot be written: No such file or directory: make the folder {} first", path.string(), folder.string());
  return format.create_frames(path, shape, options);
}

}  // namespace halfgrad
