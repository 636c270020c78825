#include "apps/export.hpp"

#include <fmt/format.h>

#include <nlohmann/json.hpp>

#include "apps/numpy_files.hpp"
#include "framework/affine_bones.hpp"
#include "framework/error.hpp"
#include "framework/interpolant.hpp"
#include "framework/io/frame_source.hpp"
#include "framework/io/output_file.hpp"
#include "framework/json_reader.hpp"
#include "framework/version.hpp"
#include "reconstruction/registry.hpp"

namespace halfgrad::app {

using SparseMatrix = Eigen::SparseMatrix<double, Eigen::RowMajor>;

namespace {

// The form of the map: as asked for, or the one that the extension holds.
std::string checked_form(const ExportOptions& options) {
  const std::string extension = options.out.extension().string();
  const std::string form = !options.as.empty() ? options.as : extension == ".json" ? "bones" : "matrix";
  if (form != "matrix" && form != "stencils" && form != "bones")
    raise("--as {}: expected matrix, stencils or bones", form);
  const bool fits = form == "bones"    ? extension == ".json"
                    : form == "matrix" ? extension == ".npz" || extension == ".mtx"
                                       : extension == ".npz";
  if (!fits)
    raise("--out {}: {} are written as {}", options.out.string(), form == "matrix" ? "matrices" : form,
          form == "bones"    ? ".json with .npy files beside it"
          : form == "matrix" ? ".npz (SciPy) or .mtx (Matrix Market), bones as .json"
                             : ".npz");
  if (options.transpose && form != "matrix") raise("--transpose: only a matrix has one, not {}", form);
  if (!options.frames.empty() && form != "bones")
    raise("--frames: only bones move with them; a matrix or stencils serve any frame");
  return form;
}

void require_matrix(const BindSettings& settings, const Binding& bound) {
  if (!bound.reconstruction || !bound.reconstruction->blend) return;
  std::vector<std::string_view> others;
  for (const ReconstructorEntry& entry : reconstructor_registry())
    if (entry.name != settings.reconstructor) others.push_back(entry.name);
  raise(
      "--reconstructor {}: it decides by the data of each frame, so the map is no matrix; expected one of {} (kriging "
      "is the most accurate), or --as bones with --frames",
      settings.reconstructor, join_names(others));
}

// The numbers in the precision asked for; the array keeps them.
class Numbers {
 public:
  Numbers(const double* data, std::int64_t size, bool as_float) {
    if (as_float)
      floats_.assign(data, data + size);
    else
      doubles_ = {data, static_cast<std::size_t>(size)};
  }
  NumpyArray array(std::string name, std::vector<std::int64_t> shape) const {
    return floats_.empty() ? numpy_array(std::move(name), doubles_, std::move(shape))
                           : numpy_array(std::move(name), floats_, std::move(shape));
  }

 private:
  std::span<const double> doubles_;
  std::vector<float> floats_;
};

template <class T>
std::span<const T> rows_of(const T* data, Eigen::Index size) {
  return {data, static_cast<std::size_t>(size)};
}

// The arrays that scipy.sparse.save_npz writes for a csr_matrix.
void write_scipy(const std::filesystem::path& path, const SparseMatrix& matrix, bool as_float) {
  const std::int64_t rows = matrix.rows(), entries = matrix.nonZeros();
  const std::array<std::int64_t, 2> shape = {matrix.rows(), matrix.cols()};
  const Numbers data(matrix.valuePtr(), entries, as_float);
  write_npz(path, std::array{numpy_array("indices", rows_of(matrix.innerIndexPtr(), entries), {entries}),
                             numpy_array("indptr", rows_of(matrix.outerIndexPtr(), rows + 1), {rows + 1}),
                             NumpyArray{"format", "|S3", {}, "csr"}, numpy_array("shape", shape, {2}),
                             data.array("data", {entries})});
}

// The arrays of OpenSubdiv's StencilTable, by the names of its accessors.
void write_stencils(const std::filesystem::path& path, const SparseMatrix& matrix, bool as_float) {
  const std::int64_t rows = matrix.rows(), entries = matrix.nonZeros();
  std::vector<std::int32_t> sizes(static_cast<std::size_t>(rows));
  for (std::int64_t r = 0; r < rows; ++r) sizes[r] = matrix.outerIndexPtr()[r + 1] - matrix.outerIndexPtr()[r];
  const std::array<std::int32_t, 1> num_control_vertices = {static_cast<std::int32_t>(matrix.cols())};
  const Numbers weights(matrix.valuePtr(), entries, as_float);
  write_npz(path, std::array{numpy_array("sizes", sizes, {rows}),
                             numpy_array("offsets", rows_of(matrix.outerIndexPtr(), rows), {rows}),
                             numpy_array("indices", rows_of(matrix.innerIndexPtr(), entries), {entries}),
                             weights.array("weights", {entries}),
                             numpy_array("num_control_vertices", num_control_vertices, {})});
}

void write_matrix_market(const std::filesystem::path& path, const SparseMatrix& matrix, bool as_float) {
  OutputFile file(path);
  std::string text = fmt::format("%%MatrixMarket matrix coordinate real general\n% halfgrad {}\n{} {} {}\n", version,
                                 matrix.rows(), matrix.cols(), matrix.nonZeros());
  for (Eigen::Index r = 0; r < matrix.rows(); ++r) {
    for (SparseMatrix::InnerIterator entry(matrix, r); entry; ++entry)
      if (as_float)
        fmt::format_to(std::back_inserter(text), "{} {} {}\n", r + 1, entry.col() + 1,
                       static_cast<float>(entry.value()));
      else
        fmt::format_to(std::back_inserter(text), "{} {} {}\n", r + 1, entry.col() + 1, entry.value());
    if (text.size() > 1 << 20) {
      file.write(text);
      text.clear();
    }
  }
  file.write(text);
  file.commit();
}

std::filesystem::path beside(const std::filesystem::path& out, const std::string& word) {
  return out.parent_path() / (out.stem().string() + "." + word + ".npy");
}

// Transforms of a range of frames into one array, a frame at a time; returns its shape.
template <class Scalar>
std::vector<std::int64_t> write_transforms(const ExportOptions& options, const BindSettings& settings,
                                           const Binding& bound, const AffineBones& bones, FrameSource& source,
                                           const std::filesystem::path& path) {
  const std::int64_t last = options.last < 0 ? source.num_frames() - 1 : options.last;
  const std::vector<std::int64_t> shape = {(last - options.first) / options.step + 1,
                                           static_cast<std::int64_t>(bones.vertices.size()), source.num_columns(),
                                           bound.mesh.gdim() + 1};
  const Interpolant<Scalar> interpolant(bound.mesh, bound.embedding, settings.interpolant.rule,
                                        bound.reconstruction ? &*bound.reconstruction : nullptr);
  OutputFile file(path);
  file.write(npy_header(npy_type<Scalar>(), shape));
  Progress progress(options.quiet ? ProgressMode::never : options.progress, "export", shape[0], "frames");
  Values<Scalar> values, gradients;
  std::int64_t done = 0;
  for (std::int64_t frame = options.first; frame <= last; frame += options.step) {
    source.read(static_cast<Index>(frame), values);
    if (settings.interpolant.rule.needs_gradients()) gradients = interpolant.vertex_gradients(values);
    const Values<Scalar> transforms =
        bone_transforms(bones.vertices, bound.mesh.vertices(), values, gradients, settings.interpolant.rule.alpha);
    file.write(numpy_array("", transforms, {}).bytes);
    progress.advance(++done);
  }
  file.commit();
  return shape;
}

std::int64_t write_bones(const ExportOptions& options, const BindSettings& settings, const Binding& bound,
                         FrameSource* source) {
  const AffineBones bones = affine_bones(bound.mesh, bound.embedding);
  const std::int64_t num_bones = static_cast<std::int64_t>(bones.vertices.size()), num_points = bones.indices.rows(),
                     influences = bones.indices.cols();
  Points rest(num_bones, bound.mesh.gdim());
  for (std::int64_t b = 0; b < num_bones; ++b) rest.row(b) = bound.mesh.vertices().row(bones.vertices[b]);
  const bool as_float = options.precision == "float";
  const Numbers weights(bones.weights.data(), bones.weights.size(), as_float);
  const Numbers rest_numbers(rest.data(), rest.size(), false),
      point_numbers(bound.points.data(), bound.points.size(), false);
  const std::array arrays = {numpy_array("indices", bones.indices, {num_points, influences}),
                             weights.array("weights", {num_points, influences}),
                             point_numbers.array("points", {num_points, bound.mesh.gdim()}),
                             rest_numbers.array("rest", {num_bones, bound.mesh.gdim()}),
                             numpy_array("vertices", bones.vertices, {num_bones})};

  nlohmann::ordered_json manifest = {
      {"format", "halfgrad affine bones"},
      {"version", 1},
      {"formula", "x_p = sum_k weights[p, k] * transforms[frame, indices[p, k]] @ [points[p], 1]"},
      {"interpolant", settings.interpolant.name},
      {"alpha", settings.interpolant.rule.alpha},
      {"reconstructor",
       settings.interpolant.rule.needs_gradients() ? nlohmann::json(settings.reconstructor) : nlohmann::json(nullptr)},
      {"num_points", num_points},
      {"num_bones", num_bones},
      {"influences", influences}};
  nlohmann::ordered_json files;
  const auto add = [&](const std::string& name, const std::string& type, const std::vector<std::int64_t>& shape) {
    files[name] = {{"file", beside(options.out, name).filename().string()}, {"type", type}, {"shape", shape}};
  };
  for (const NumpyArray& array : arrays) {
    write_npy_array(beside(options.out, array.name), array);
    add(array.name, array.type, array.shape);
  }
  if (source != nullptr) {
    const std::filesystem::path path = beside(options.out, "transforms");
    if (as_float)
      add("transforms", npy_type<float>(), write_transforms<float>(options, settings, bound, bones, *source, path));
    else
      add("transforms", npy_type<double>(), write_transforms<double>(options, settings, bound, bones, *source, path));
    manifest["first_frame"] = options.first;
    manifest["frame_step"] = options.step;
  }
  manifest["arrays"] = std::move(files);
  write_text_atomically(options.out, manifest.dump(2) + "\n");
  return num_bones;
}

std::unique_ptr<FrameSource> open_checked_frames(const ExportOptions& options, const std::filesystem::path& rest,
                                                 Index num_vertices) {
  if (options.step < 1) raise("--step {}: expected 1 or more", options.step);
  std::unique_ptr<FrameSource> source = open_frames(options.frames);
  if (source->num_vertices() != num_vertices)
    raise("{}: frames of {} vertices, but {} has {}", options.frames, source->num_vertices(), rest.string(),
          num_vertices);
  const std::int64_t last = options.last < 0 ? source->num_frames() - 1 : options.last;
  if (options.first < 0 || options.first > last || last >= source->num_frames())
    raise("frames {} to {} asked for: {} has frames 0 to {}", options.first, last, options.frames,
          source->num_frames() - 1);
  return source;
}

}  // namespace

void export_map(const ExportOptions& options) {
  const std::string form = checked_form(options);
  const BindSettings settings = parse_settings(options.bind, "kriging");
  const InterpolationRule& rule = settings.interpolant.rule;
  if (settings.is_baseline())
    raise(
        "--interpolant {}: it carries displacements of vertices, which is no map of their positions; expected a rule "
        "on cells such as phong",
        settings.interpolant.name);
  if (form == "bones" && rule.formula != Formula::blend)
    raise("--interpolant {}: affine bones are linear, phong and vertex_blend; export the others as a matrix",
          settings.interpolant.name);
  if (options.precision != "float" && options.precision != "double")
    raise("--precision {}: expected float or double", options.precision);

  Binding bound = read_inputs(settings);
  if (bound.on_surface())
    raise("{}: found a surface in space: what it carries follows its normals, so the map is no matrix; use deform",
          settings.rest.string());
  const std::unique_ptr<FrameSource> source =
      options.frames.empty() ? nullptr : open_checked_frames(options, settings.rest, bound.num_vertices());
  locate(settings, bound);
  // Bones alone are shape functions; their transforms take the gradients.
  if (rule.needs_gradients() && (form != "bones" || source)) reconstruct(settings, bound);
  // The same cells and vertices by the same numbers.
  if (bound.grid) bound.mesh = bound.grid->mesh();

  std::string what;
  if (form == "bones") {
    const std::int64_t num_bones = write_bones(options, settings, bound, source.get());
    what = fmt::format("{} bones for {} points", num_bones, bound.points.rows());
  } else {
    require_matrix(settings, bound);
    SparseMatrix matrix =
        Interpolant<double>(bound.mesh, bound.embedding, rule, bound.reconstruction ? &*bound.reconstruction : nullptr)
            .matrix();
    if (options.transpose) matrix = SparseMatrix(matrix.transpose());
    matrix.makeCompressed();
    const bool as_float = options.precision == "float";
    if (form == "stencils")
      write_stencils(options.out, matrix, as_float);
    else if (options.out.extension() == ".npz")
      write_scipy(options.out, matrix, as_float);
    else
      write_matrix_market(options.out, matrix, as_float);
    what = fmt::format("{} of {} x {} with {} entries", form, matrix.rows(), matrix.cols(), matrix.nonZeros());
  }
  if (options.quiet) return;
  fmt::print("{} written to {}\n", what, options.out.string());
  fmt::print("{}{}\n", settings.interpolant.name, bound.reconstruction ? " with " + settings.reconstructor : "");
  if (!bound.embedding.outside.empty())
    fmt::print("{} points outside the mesh ({})\n", bound.embedding.outside.size(),
               settings.outside == "nearest" ? "carried by the nearest cell" : "without weights");
}

}  // namespace halfgrad::app
