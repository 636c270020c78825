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
#include "framework/json_values.hpp"
#include "framework/version.hpp"
#include "reconstruction/registry.hpp"

namespace halfgrad::app {

using nlohmann::json;

namespace {

template <class Scalar>
std::int64_t carry_frames(const DeformOptions& options, const ScatteredTransfer& transfer, const PointSet& surface,
                          FrameSource& source, std::int64_t last) {
  const std::unique_ptr<FrameSink> sink = create_frames(options.out, surface, {options.first, options.step});
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
json parse_name(const std::string& text, const char* option) {
  if (text.empty() || text[0] != '{') return text;
  return parse_json(text, option);
}

}  // namespace

bool is_scattered(const std::string& interpolant) {
  json ignored;
  const ConfiguredInterpolant named =
      read_interpolant(parse_name(interpolant, "--interpolant"), "--interpolant", ignored);
  if (!named.scattered && interpolant != named.name)
    raise("--interpolant {}: {} takes no options in JSON (vertex_blend takes --alpha)", interpolant, named.name);
  return named.scattered.has_value();
}

void deform_scattered(const DeformOptions& options) {
  json resolved;
  const ConfiguredInterpolant interpolant =
      read_interpolant(parse_name(*options.bind.interpolant, "--interpolant"), "--interpolant", resolved);
  const auto refuse = [&](bool given, const char* option) {
    if (given) raise("{}: {} knows vertices only and does not take it", option, interpolant.name);
  };
  refuse(!options.bind.binding.empty(), "--binding");
  refuse(options.bind.outside.has_value(), "--outside");
  refuse(options.normals.has_value(), "--normals");
  refuse(options.gradients, "--gradients");
  refuse(options.stretch, "--stretch");
  refuse(!options.fields.empty(), "--field");
  refuse(options.resume, "--resume");
  refuse(options.tolerance > 0, "--tolerance");
  refuse(options.bind.alpha.has_value(), "--alpha");
  if (options.bind.rest.empty()) raise("--rest is missing");
  if (options.bind.points.empty()) raise("--points is missing");
  if (options.precision != "float" && options.precision != "double")
    raise("--precision {}: expected float or double", options.precision);
  if (options.step < 1) raise("--step {}: expected 1 or more", options.step);
  std::optional<MadeReconstructor> made;
  if (interpolant.needs_gradients()) {
    const std::string& name = options.bind.reconstructor;
    made = make_reconstructor(parse_name(name.empty() ? "chandrashekar_garg" : name, "--reconstructor"),
                              "--reconstructor");
  }

  const Mesh mesh = read_mesh(options.bind.rest);
  const PointSet surface = read_points(options.bind.points);
  const std::unique_ptr<FrameSource> source = open_frames(options.frames);
  if (source->num_vertices() != mesh.num_vertices())
    raise("{}: frames of {} vertices, but {} has {}", options.frames, source->num_vertices(),
          options.bind.rest.string(), mesh.num_vertices());
  const std::int64_t last = options.last < 0 ? source->num_frames() - 1 : options.last;
  if (options.first < 0 || options.first > last || last >= source->num_frames())
    raise("frames {} to {} asked for: {} has frames 0 to {}", options.first, last, options.frames,
          source->num_frames() - 1);
  const Points points = in_dimension(surface.points, mesh.gdim(), options.bind.points.string());
  const ScatteredTransfer transfer(mesh, points, *interpolant.scattered, made ? made->reconstructor.get() : nullptr);
  const std::int64_t frames = options.precision == "float"
                                  ? carry_frames<float>(options, transfer, surface, *source, last)
                                  : carry_frames<double>(options, transfer, surface, *source, last);
  if (!options.report.empty()) {
    const json report = {
        {"version", version},
        {"rest", options.bind.rest.string()},
        {"frames", options.frames},
        {"points", options.bind.points.string()},
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
