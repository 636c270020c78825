#include "apps/deform_scattered.hpp"

#include <fmt/format.h>

#include <nlohmann/json.hpp>

#include "experiments/interpolant_spec.hpp"
#include "framework/error.hpp"
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

template <class Scalar>
std::int64_t carry_frames(const DeformOptions& options, const ScatteredTransfer& transfer, const PointSet& surface,
                          FrameSource& source, std::int64_t last) {
  const std::unique_ptr<FrameSink> sink = create_frames(options.out, surface);
  const std::int64_t total = (last - options.first) / options.step + 1;
  Progress progress(options.quiet ? ProgressMode::never : options.progress, "deform", total, "frames");
  Values<Scalar> values;
  std::int64_t done = 0;
  for (std::int64_t frame = options.first; frame <= last; frame += options.step) {
    source.read(static_cast<Index>(frame), values);
    sink->write(transfer.evaluate(values));
    progress.advance(++done);
  }
  sink->finish();
  return done;
}

/// A name, or JSON with options.
json parse_interpolant(const std::string& text) {
  if (text[0] != '{') return text;
  try {
    return json::parse(text);
  } catch (const json::parse_error& error) {
    raise("--interpolant {}: {}", text, error.what());
  }
}

}  // namespace

bool is_scattered(const std::string& interpolant) {
  if (find_scattered_rule(interpolant)) return true;
  if (interpolant.empty() || interpolant[0] != '{') return false;
  json ignored;
  return read_interpolant(parse_interpolant(interpolant), "--interpolant", ignored).scattered.has_value();
}

void deform_scattered(const DeformOptions& options) {
  json resolved;
  const ConfiguredInterpolant interpolant =
      read_interpolant(parse_interpolant(options.interpolant), "--interpolant", resolved);
  const auto refuse = [&](bool given, const char* option) {
    if (given) raise("{}: {} knows no cells and has none", option, interpolant.name);
  };
  refuse(options.normals, "--normals");
  refuse(options.gradients, "--gradients");
  refuse(options.tolerance > 0, "--tolerance");
  refuse(options.alpha.has_value(), "--alpha");
  if (options.precision != "float" && options.precision != "double")
    raise("--precision {}: expected float or double", options.precision);
  if (options.step < 1) raise("--step {}: expected 1 or more", options.step);
  std::optional<MadeReconstructor> made;
  if (interpolant.needs_gradients()) {
    const std::string& name = options.reconstructor;
    made = make_reconstructor(name.empty()     ? json("chandrashekar_garg")
                              : name[0] == '{' ? json::parse(name)
                                               : json(name),
                              "--reconstructor");
  }

  const Mesh mesh = read_mesh(options.rest);
  const PointSet surface = read_points(options.points);
  const std::unique_ptr<FrameSource> source = open_frames(options.frames);
  if (source->num_vertices() != mesh.num_vertices())
    raise("{}: frames of {} vertices, but {} has {}", options.frames, source->num_vertices(), options.rest.string(),
          mesh.num_vertices());
  const std::int64_t last = options.last < 0 ? source->num_frames() - 1 : options.last;
  if (options.first < 0 || options.first > last || last >= source->num_frames())
    raise("frames {} to {} asked for: {} has frames 0 to {}", options.first, last, options.frames,
          source->num_frames() - 1);
  const Points points = in_dimension(surface.points, mesh.gdim(), options.points.string());
  const ScatteredTransfer transfer(mesh, points, *interpolant.scattered, made ? made->reconstructor.get() : nullptr);
  const std::int64_t frames = options.precision == "float"
                                  ? carry_frames<float>(options, transfer, surface, *source, last)
                                  : carry_frames<double>(options, transfer, surface, *source, last);
  if (!options.report.empty()) {
    const json report = {
        {"version", version},
        {"rest", options.rest.string()},
        {"frames", options.frames},
        {"points", options.points.string()},
        {"out", options.out.string()},
        {"interpolant", interpolant.name},
        {"options", json::parse(interpolant.options)},
        {"reconstructor", made ? json(made->name) : json(nullptr)},
        {"precision", options.precision},
        {"counts", {{"frames", frames}, {"points", points.rows()}, {"weights", transfer.matrix().nonZeros()}}}};
    write_text_atomically(options.report, report.dump(2) + "\n");
  }
  if (options.quiet) return;
  fmt::print("{} frames of {} points written to {}\n", frames, points.rows(), options.out.string());
  fmt::print("{}: {:.1f} vertices a point on average\n", interpolant.name,
             static_cast<double>(transfer.matrix().nonZeros()) /
                 static_cast<double>(std::max<Eigen::Index>(points.rows(), 1)));
}

}  // namespace halfgrad::app
