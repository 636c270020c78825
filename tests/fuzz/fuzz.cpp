// Every reader under libFuzzer. An input is read, or refused with Error; a crash, another exception, a sanitizer's
// report, much memory for a small file and long running are bugs. HALFGRAD_FUZZ names the target.
#include <array>
#include <cstdio>
#include <cstdlib>
#include <string>
#include <string_view>

#include "framework/error.hpp"
#include "framework/io/binding_file.hpp"
#include "framework/io/field_source.hpp"
#include "framework/io/formats.hpp"
#include "framework/io/frame_files.hpp"
#include "framework/io/mesh_file.hpp"
#include "framework/io/npy.hpp"
#include "framework/io/point_set.hpp"
#include "fuzz/memory_file.hpp"
#ifdef HALFGRAD_FUZZ_CONFIG
#include "experiments/experiment_config.hpp"
#endif

namespace halfgrad {
namespace {

template <class Function>
void read_or_refuse(Function&& f) {
  try {
    f();
  } catch (const Error&) {
  }
}

// What follows the format's reader is tried too: meshes are inspected, points made.
void read_geometry(const char* path) {
  if (find_format(path, FormatUse::read_points).has_cells) read_or_refuse([&] { inspect(read_mesh(path)); });
  read_or_refuse([&] { in_dimension(read_points(path).points, 2, path); });
}

void read_all(FrameSource& source) {
  Values<double> wide;
  Values<float> narrow;
  for (Index frame = 0; frame < source.num_frames() && frame < 8; ++frame) {
    read_or_refuse([&] { source.read(frame, wide); });
    read_or_refuse([&] { source.read(frame, narrow); });
  }
}

void read_frames(const char* path) {
  read_or_refuse([&] { read_all(*find_format(path, FormatUse::open_frames).open_frames(path)); });
}

void read_grid(const char* path) {
  read_or_refuse([&] {
    const RestShape shape = read_rest_shape(path);
    const Grid& grid = std::get<Grid>(shape);
    grid.position(grid.num_vertices() - 1);
  });
  read_geometry(path);
}

// The files of the corpus are bindings of four points to two triangles of a square.
void read_binding_of_square(const char* path) {
  read_or_refuse([&] { read_binding(path, {.gdim = 2, .num_vertices = 4, .num_cells = 2, .num_points = 4}, "print"); });
  read_or_refuse([&] { read_binding_settings(path); });
}

// The first file is a frame and the rest shape, the second an array.
void read_field(const char* path) {
  read_or_refuse([&] {
    const auto frames = open_frame_files("frames", {path, path});
    Values<double> values;
    for (const std::string& spec : {std::string("heat"), std::string("heat=second.npy")})
      read_or_refuse([&] { FieldSource(spec, path, *frames).read(0, values); });
  });
  read_or_refuse([&] { read_all(*open_npy_values("second.npy")); });
}

#ifdef HALFGRAD_FUZZ_CONFIG
void check_config(const char* path) {
  for (const char reduced : {'n', 'y'}) read_or_refuse([&] { read_experiment_config(path, {}, reduced == 'y'); });
}
#endif

struct Target {
  std::string_view name;
  const char* file;  // what the input is called
  void (*run)(const char* path);
};
constexpr Target targets[] = {
    {"gmsh", "x.msh", read_geometry},
    {"vtk_legacy", "x.vtk", read_geometry},
    {"vtk_xml", "x.vtu", read_geometry},
    {"vtk_grid", "x.vti", read_grid},
    {"medit", "x.mesh", read_geometry},
    {"tetgen", "x.node", read_geometry},
    {"obj", "x.obj", read_geometry},
    {"ply", "x.ply", read_geometry},
    {"stl", "x.stl", read_geometry},
    {"npy", "x.npy",
     [](const char* path) {
       read_geometry(path);
       read_frames(path);
       read_or_refuse([&] { read_npy(path); });
     }},
    {"pc2", "x.pc2", read_frames},
    {"pvd", "x.pvd", read_frames},
    {"field", "x.vtu", read_field},
    {"binding", "x.hgb", read_binding_of_square},
#ifdef HALFGRAD_FUZZ_CONFIG
    {"config", "x.json", check_config},
#endif
};

const Target* target = nullptr;

}  // namespace
}  // namespace halfgrad

using namespace halfgrad;

extern "C" int LLVMFuzzerInitialize(int*, char***) {
  const char* wanted = std::getenv("HALFGRAD_FUZZ");
  std::string names;
  for (const Target& known : targets) {
    names += std::string(known.name) + "\n";
    if (wanted != nullptr && known.name == wanted) target = &known;
  }
  if (target == nullptr) {
    std::fprintf(stdout, "%s", names.c_str());
    std::exit(wanted == nullptr ? 0 : 2);
  }
  return 0;
}

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  MemoryFiles::set(target->file, {reinterpret_cast<const char*>(data), size});
  target->run(target->file);
  return 0;
}
