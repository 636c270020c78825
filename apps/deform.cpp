#include "apps/deform.hpp"

#include <fmt/format.h>

#include <Eigen/Geometry>
#include <chrono>
#include <cmath>
#include <nlohmann/json.hpp>

#include "framework/error.hpp"
#include "framework/interpolant.hpp"
#include "framework/io/frame_sink.hpp"
#include "framework/io/frame_source.hpp"
#include "framework/io/mesh_file.hpp"
#include "framework/io/output_file.hpp"
#include "framework/io/point_set.hpp"
#include "framework/version.hpp"
#include "reconstruction/registry.hpp"

namespace halfgrad::app {

using nlohmann::json;

namespace {

// Seconds by stage, in the order in which stages first ran.
class Stopwatch {
 public:
  void start() { last_ = std::chrono::steady_clock::now(); }
  void lap(const std::string& stage) {
    const auto now = std::chrono::steady_clock::now();
    seconds_[stage] = seconds_.value(stage, 0.0) + std::chrono::duration<double>(now - last_).count();
    last_ = now;
  }
  const json& seconds() const { return seconds_; }

 private:
  std::chrono::steady_clock::time_point last_ = std::chrono::steady_clock::now();
  json seconds_ = json::object();
};

// Where the user names none: the rule that was measured to be safe on every kind of data (docs/adaptive.md), and the
// one that gives Hessians where they are needed.
json parse_reconstructor(const std::string& text, const InterpolationRule& rule) {
  if (text.empty()) return rule.needs_hessians() ? json{{"kriging", {{"drift", "cubic"}}}} : json("adaptive");
  if ((text[0] != '{' && text[0] != '"')) return text;
  try {
    return json::parse(text);
  } catch (const json::parse_error& error) {
    raise("--reconstructor {}: {}", text, error.what());
  }
}

Outside parse_outside(const std::string& word) {
  if (word == "error") return Outside::error;
  if (word == "nearest") return Outside::nearest;
  if (word == "mark") return Outside::mark;
  raise("--outside {}: expected error, nearest or mark", word);
}

InterpolationRule parse_rule(const DeformOptions& options) {
  InterpolationRule rule = named_rule(options.interpolant);
  if (options.alpha) {
    if (options.interpolant != "vertex_blend")
      raise("--alpha {}: only vertex_blend takes it; {} has its own", *options.alpha, options.interpolant);
    rule.alpha = *options.alpha;
  }
  return rule;
}

// Area-weighted normals at the points of a surface, #points × 3; zero where a point has no face.
Points surface_normals(const PointSet& surface) {
  Points normals = Points::Zero(surface.points.rows(), 3);
  for (Index f = 0; f < surface.faces.num_rows(); ++f) {
    const std::span<const Index> face = surface.faces[f];
    Eigen::RowVector3d area = Eigen::RowVector3d::Zero();
    for (std::size_t i = 1; i + 1 < face.size(); ++i) {
      const Eigen::RowVector3d a = surface.points.row(face[i]) - surface.points.row(face[0]);
      const Eigen::RowVector3d b = surface.points.row(face[i + 1]) - surface.points.row(face[0]);
      area += a.cross(b);
    }
    for (Index v : face) normals.row(v) += area;
  }
  for (Eigen::Index p = 0; p < normals.rows(); ++p)
    if (const double length = normals.row(p).norm(); length > 0) normals.row(p) /= length;
  return normals;
}

// n ∝ cof(F) N, which is F⁻ᵀN up to a factor and needs no inverse; gradients are #points × 9.
template <class Scalar>
Values<Scalar> carried_normals(const Values<Scalar>& gradients, const Points& normals) {
  Values<Scalar> result(normals.rows(), 3);
  for (Eigen::Index p = 0; p < normals.rows(); ++p) {
    const auto F = gradients.row(p).template cast<double>().eval();
    const Eigen::Vector3d r0(F[0], F[1], F[2]), r1(F[3], F[4], F[5]), r2(F[6], F[7], F[8]);
    const Eigen::Vector3d N = normals.row(p).transpose();
    Eigen::Vector3d n(r1.cross(r2).dot(N), r2.cross(r0).dot(N), r0.cross(r1).dot(N));
    if (const double length = n.norm(); length > 0) n /= length;
    result.row(p) = n.transpose().template cast<Scalar>();
  }
  return result;
}

// "name.ext" with a word before the extension, for data that the output's own format does not hold.
std::filesystem::path beside(const std::filesystem::path& out, const std::string& word) {
  return out.parent_path() / (out.stem().string() + "." + word + ".npy");
}

json vertex_rules(const GradientStencilTable& table) {
  constexpr std::array names = {"average", "full_fit", "wider_patch", "damped", "cell_value", "none"};
  json counts = json::object();
  for (const StencilDiagnostics& row : table.diagnostics) {
    json& count = counts[names[static_cast<std::size_t>(row.rule)]];
    count = count.is_null() ? 1 : count.get<std::int64_t>() + 1;
  }
  return counts;
}

// Everything bound, then all frames: the part that depends on the precision.
template <class Scalar>
json run_frames(const DeformOptions& options, const Mesh& mesh, const Embedding& embedding,
                const InterpolationRule& rule, const Reconstruction* reconstruction, const PointSet& surface,
                FrameSource& source, Stopwatch& watch) {
  const Interpolant<Scalar> interpolant(mesh, embedding, rule, reconstruction);
  watch.lap("bind");

  const bool in_file = options.out.extension() == ".pvd";
  const bool with_gradients = options.gradients || options.normals;
  Points normals;
  if (options.normals) {
    if (mesh.gdim() != 3 || source.num_columns() != 3) raise("--normals: needs a mesh and frames in three dimensions");
    if (surface.faces.num_rows() == 0) raise("--normals: {} has no faces", options.points.string());
    normals = surface_normals(surface);
  }
  const std::unique_ptr<FrameSink> sink = create_frames(options.out, surface);
  std::unique_ptr<FrameSink> normal_sink, gradient_sink;
  if (options.normals && !in_file) normal_sink = create_frames(beside(options.out, "normals"));
  if (options.gradients && !in_file) gradient_sink = create_frames(beside(options.out, "gradients"));

  const std::int64_t last = options.last < 0 ? source.num_frames() - 1 : options.last;
  const std::int64_t total = (last - options.first) / options.step + 1;
  Values<Scalar> values, out;
  Workspace<Scalar> workspace;
  Progress progress(options.quiet ? ProgressMode::never : options.progress, "deform", total, "frames");
  std::int64_t done = 0;
  Index linear_cells = 0;
  for (std::int64_t frame = options.first; frame <= last; frame += options.step) {
    watch.start();
    source.read(static_cast<Index>(frame), values);
    watch.lap("read_frames");
    interpolant.evaluate(values, out, workspace, {.tolerance = options.tolerance});
    watch.lap("evaluate");
    if (options.tolerance > 0 && !options.report.empty())
      linear_cells += interpolant.num_linear_cells(values, {.tolerance = options.tolerance});
    std::vector<PointArray> arrays;
    if (with_gradients) {
      const Values<Scalar> gradients = interpolant.gradient(values);
      if (options.gradients && in_file) arrays.push_back({"gradient", gradients.template cast<double>()});
      if (gradient_sink) gradient_sink->write(gradients);
      if (options.normals) {
        const Values<Scalar> carried = carried_normals(gradients, normals);
        if (in_file) arrays.push_back({"normals", carried.template cast<double>()});
        if (normal_sink) normal_sink->write(carried);
      }
      watch.lap("gradients");
    }
    sink->write(out, arrays);
    watch.lap("write");
    progress.advance(++done);
  }
  sink->finish();
  if (normal_sink) normal_sink->finish();
  if (gradient_sink) gradient_sink->finish();
  watch.lap("write");

  const BindReport& report = interpolant.report();
  json counts = {{"frames", done},
                 {"points", report.num_points},
                 {"inside", report.num_inside},
                 {"on_boundary", report.num_boundary},
                 {"outside", report.num_outside},
                 {"not_found", report.num_not_found},
                 {"vertices", report.num_vertices},
                 {"active_vertices", report.num_active_vertices},
                 {"cells", report.num_cells},
                 {"active_cells", report.num_active_cells},
                 {"stencil_entries", report.num_stencil_entries},
                 {"binding_bytes", report.bytes}};
  json skipped = {{"cells", report.num_cells - report.num_active_cells},
                  {"vertices", report.num_vertices - report.num_active_vertices},
                  {"linear_cells", linear_cells}};
  return {{"counts", counts}, {"skipped", skipped}};
}

}  // namespace

void deform(const DeformOptions& options) {
  Stopwatch watch;
  const InterpolationRule rule = parse_rule(options);
  const json specification = parse_reconstructor(options.reconstructor, rule);
  if (options.precision != "float" && options.precision != "double")
    raise("--precision {}: expected float or double", options.precision);
  if (!(options.tolerance >= 0)) raise("--tolerance {}: expected a length >= 0", options.tolerance);
  if (options.step < 1) raise("--step {}: expected 1 or more", options.step);
  for (const std::filesystem::path& input : {options.rest, options.points, std::filesystem::path(options.frames)}) {
    std::error_code ignored;
    if (std::filesystem::equivalent(options.out, input, ignored))
      raise("--out {} is also an input: name another file", options.out.string());
  }
  // Names and options are checked before the first large file is read.
  const MadeReconstructor made = make_reconstructor(specification, "--reconstructor");

  const Mesh mesh = read_mesh(options.rest);
  const MeshReport quality = inspect(mesh);
  if (!quality.degenerate_cells.empty())
    raise("{}: {} of {} cells have no volume, the first is cell {} ({})", options.rest.string(),
          quality.degenerate_cells.size(), mesh.num_cells(), quality.degenerate_cells[0],
          element_name(mesh, quality.degenerate_cells[0]));
  PointSet surface = read_points(options.points);
  const std::unique_ptr<FrameSource> source = open_frames(options.frames);
  if (source->num_vertices() != mesh.num_vertices())
    raise("{}: frames of {} vertices, but {} has {}", options.frames, source->num_vertices(), options.rest.string(),
          mesh.num_vertices());
  const std::int64_t last = options.last < 0 ? source->num_frames() - 1 : options.last;
  if (options.first < 0 || options.first > last || last >= source->num_frames())
    raise("frames {} to {} asked for: {} has frames 0 to {}", options.first, last, options.frames,
          source->num_frames() - 1);
  const Points points = in_dimension(surface.points, mesh.gdim(), options.points.string());
  watch.lap("read");

  const Embedding embedding = embed(mesh, points, {.outside = parse_outside(options.outside)});
  watch.lap("locate");
  std::optional<Reconstruction> reconstruction;
  if (rule.needs_gradients() || options.gradients || options.normals)
    reconstruction = made.reconstructor->reconstruct(CellGradients(mesh), active_vertices(mesh, embedding));
  watch.lap("reconstruct");

  const Reconstruction* given = reconstruction ? &*reconstruction : nullptr;
  json report = options.precision == "float"
                    ? run_frames<float>(options, mesh, embedding, rule, given, surface, *source, watch)
                    : run_frames<double>(options, mesh, embedding, rule, given, surface, *source, watch);
  report["version"] = version;
  report["rest"] = options.rest.string();
  report["frames"] = options.frames;
  report["points"] = options.points.string();
  report["out"] = options.out.string();
  report["interpolant"] = options.interpolant;
  report["alpha"] = rule.formula == Formula::blend ? json(rule.alpha) : json(nullptr);
  report["reconstructor"] = rule.needs_gradients() ? json(made.name) : json(nullptr);
  report["options"] = json::parse(made.options);
  report["precision"] = options.precision;
  report["seconds"] = watch.seconds();
  report["mesh"] = {{"inverted_cells", quality.inverted_cells.size()},
                    {"folded_cells", quality.folded_cells.size()},
                    {"unused_vertices", quality.unused_vertices.size()},
                    {"min_quality", quality.min_quality}};
  if (reconstruction) report["vertex_rules"] = vertex_rules(reconstruction->stencils);
  double farthest = 0;
  json outside_points = json::array();
  for (const OutsidePoint& outside : embedding.outside) {
    farthest = std::max(farthest, outside.distance);
    outside_points.push_back({{"point", outside.point}, {"distance", outside.distance}});
  }
  report["outside"] = {{"policy", options.outside},
                       {"count", embedding.outside.size()},
                       {"max_distance", farthest},
                       {"points", outside_points}};
  if (!options.report.empty()) write_text_atomically(options.report, report.dump(2) + "\n");

  if (options.quiet) return;
  const json& counts = report["counts"];
  fmt::print("{} frames of {} points written to {}\n", counts["frames"].get<std::int64_t>(),
             counts["points"].get<std::int64_t>(), options.out.string());
  fmt::print("{}{}; {} of {} cells and {} of {} vertices used\n", options.interpolant,
             rule.needs_gradients() ? " with " + made.name : "", counts["active_cells"].get<std::int64_t>(),
             counts["cells"].get<std::int64_t>(), counts["active_vertices"].get<std::int64_t>(),
             counts["vertices"].get<std::int64_t>());
  if (!embedding.outside.empty())
    fmt::print("{} points outside the mesh, {} {} away at most ({})\n", embedding.outside.size(), farthest,
               "length units", options.outside == "nearest" ? "carried by the nearest cell" : "marked with NaN");
  if (!quality.folded_cells.empty())
    fmt::print("{} cells of {} fold over themselves at rest\n", quality.folded_cells.size(), options.rest.string());
}

}  // namespace halfgrad::app
