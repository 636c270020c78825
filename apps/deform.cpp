#include "apps/deform.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <csignal>
#include <nlohmann/json.hpp>

#include "apps/channels.hpp"
#include "framework/error.hpp"
#include "framework/fingerprint.hpp"
#include "framework/io/frame_sink.hpp"
#include "framework/io/frame_source.hpp"
#include "framework/io/output_file.hpp"
#include "framework/version.hpp"

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

volatile std::sig_atomic_t caught_signal = 0;

// While it lives, SIGINT and SIGTERM are noted instead of ending the program, so that a frame is written whole.
class SignalWatch {
 public:
  SignalWatch() {
    caught_signal = 0;
    const auto note = [](int signal) { caught_signal = signal; };
    interrupt_ = std::signal(SIGINT, note);
    terminate_ = std::signal(SIGTERM, note);
  }
  ~SignalWatch() {
    std::signal(SIGINT, interrupt_);
    std::signal(SIGTERM, terminate_);
  }
  SignalWatch(const SignalWatch&) = delete;
  SignalWatch& operator=(const SignalWatch&) = delete;
  int signal() const { return caught_signal; }

 private:
  void (*interrupt_)(int);
  void (*terminate_)(int);
};

// Signed: behind the surface's normals is negative.
json distance_range(const std::vector<double>& distance) {
  if (distance.empty()) return {{"least", 0.0}, {"greatest", 0.0}};
  const auto [least, greatest] = std::minmax_element(distance.begin(), distance.end());
  return {{"least", *least}, {"greatest", *greatest}};
}

// The frames asked for.
struct FrameRange {
  std::int64_t first, last, step;
  std::int64_t count() const { return (last - first) / step + 1; }
  Index frame(std::int64_t i) const { return static_cast<Index>(first + i * step); }
};

FrameRange frame_range(const DeformOptions& options, const FrameSource& source) {
  const FrameRange range{options.first, options.last < 0 ? source.num_frames() - 1 : options.last, options.step};
  if (range.first < 0 || range.first > range.last || range.last >= source.num_frames())
    raise("frames {} to {} asked for: {} has frames 0 to {}", range.first, range.last, options.frames,
          source.num_frames() - 1);
  return range;
}

// All that decides the bytes of a frame, but for the frame itself: another run never goes on behind this one's frames.
std::string run_name(const DeformOptions& options, const BindSettings& settings, const Binding& binding,
                     const FrameRange& range) {
  Fingerprint print;
  print.add(version).add(settings.to_json()).add(binding.fingerprint).add(options.frames).add(options.precision);
  print.add(fmt::format("{} {} {}", options.tolerance, range.first, range.step));
  print.add(
      fmt::format("{} {} {} {}", options.gradients, options.stretch, options.normals.value_or(""), options.tangents));
  for (const std::string& field : options.fields) print.add(field);
  return print.text();
}

// How many of the first `most` frames come from files older than the interrupted run. Times of files advance in ticks,
// so one of the same tick may be newer.
Index num_unchanged(const FrameSource& source, const FrameRange& range, const std::filesystem::path& mark, Index most) {
  std::error_code absent;
  const auto begun = std::filesystem::last_write_time(mark, absent);
  for (Index i = 0; i < most; ++i)
    if (std::filesystem::last_write_time(source.frame_name(range.frame(i)), absent) >= begun || absent) return i;
  return most;
}

struct Tally {
  std::int64_t written = 0, resumed = 0;
  Index linear_cells = 0;
  BindReport report;
};

// Everything bound, then all frames: the part that depends on the precision.
template <class Scalar>
Tally run_frames(const DeformOptions& options, const BindSettings& settings, const Binding& binding,
                 FrameSource& source, const FrameRange& range, Stopwatch& watch) {
  const Carrier<Scalar> carrier = make_carrier<Scalar>(binding, settings.interpolant.rule);
  watch.lap("bind");

  const FrameSinkOptions sink_options{range.first, range.step, run_name(options, settings, binding, range),
                                      options.resume ? Unfinished::resume : Unfinished::discard};
  const std::unique_ptr<FrameSink> sink = create_frames(options.out, binding.surface, sink_options);
  Channels<Scalar> channels(options, binding, source, sink_options);

  Tally tally;
  tally.report = carrier.report;
  // The last frame is written anew, and with it what the files say of all frames.
  if (options.resume) {
    const Index kept = num_unchanged(
        source, range, run_mark(options.out),
        std::min<Index>(channels.num_resumable(sink->num_resumable()), static_cast<Index>(range.count() - 1)));
    sink->resume(kept);
    channels.resume(kept);
    tally.resumed = kept;
  }
  Values<Scalar> values, out;
  Progress progress(options.quiet ? ProgressMode::never : options.progress, "deform", range.count(), "frames");
  const SignalWatch signals;
  try {
    for (std::int64_t i = tally.resumed; i < range.count(); ++i) {
      watch.start();
      source.read(range.frame(i), values);
      watch.lap("read_frames");
      carrier.evaluate(values, out, {.tolerance = options.tolerance});
      watch.lap("evaluate");
      if (options.tolerance > 0 && !options.report.empty())
        tally.linear_cells += carrier.num_linear_cells(values, {.tolerance = options.tolerance});
      const std::span<const PointArray> arrays = channels.carry(carrier, values, range.frame(i));
      watch.lap("arrays");
      sink->write(out, arrays);
      watch.lap("write");
      ++tally.written;
      progress.advance(i + 1);
      if (signals.signal() != 0 && i + 1 < range.count())
        throw Interrupted(fmt::format("interrupted after {} of {} frames: the same command with --resume goes on",
                                      i + 1, range.count()),
                          signals.signal());
    }
  } catch (const Error& error) {
    const std::int64_t done = tally.resumed + tally.written;
    if (done == 0) throw;
    raise("{}\n{} of {} frames are kept: the same command with --resume goes on behind them", error.what(), done,
          range.count());
  }
  sink->finish();
  channels.finish();
  watch.lap("write");
  return tally;
}

json report_of(const DeformOptions& options, const BindSettings& settings, const Binding& binding, const Tally& tally) {
  const BindReport& bound = tally.report;
  json report;
  report["counts"] = {{"frames", tally.written + tally.resumed},
                      {"resumed_frames", tally.resumed},
                      {"points", bound.num_points},
                      {"vertices", bound.num_vertices},
                      {"active_vertices", bound.num_active_vertices},
                      {"cells", bound.num_cells},
                      {"binding_bytes", bound.bytes}};
  report["skipped"] = {{"vertices", bound.num_vertices - bound.num_active_vertices}};
  if (settings.is_baseline()) {
    report["counts"]["weights"] = binding.transfer->matrix().nonZeros();
  } else {
    report["counts"].update({{"inside", bound.num_inside},
                             {"on_boundary", bound.num_boundary},
                             {"outside", bound.num_outside},
                             {"not_found", bound.num_not_found},
                             {"active_cells", bound.num_active_cells},
                             {"stencil_entries", bound.num_stencil_entries}});
    report["skipped"].update(
        {{"cells", bound.num_cells - bound.num_active_cells}, {"linear_cells", tally.linear_cells}});
  }
  report["version"] = version;
  report["rest"] = settings.rest.string();
  report["frames"] = options.frames;
  report["points"] = settings.points.string();
  report["binding"] = settings.binding.empty() ? json(nullptr) : json(settings.binding.string());
  report["out"] = options.out.string();
  report.update(json(rule_facts(settings)));
  report["precision"] = options.precision;
  report.update(json(diagnosis(settings, binding)));
  if (binding.on_surface()) report["distance"] = distance_range(binding.feet.distance);
  return report;
}

void print_summary(const DeformOptions& options, const BindSettings& settings, const Binding& binding,
                   const Tally& tally) {
  const BindReport& bound = tally.report;
  fmt::print("{} frames of {} points written to {}\n", tally.written, bound.num_points, options.out.string());
  if (tally.resumed > 0) fmt::print("{} frames before them were there already\n", tally.resumed);
  const std::string rule =
      settings.interpolant.name + (settings.interpolant.needs_gradients() ? " with " + settings.reconstructor : "");
  if (settings.is_baseline()) {
    fmt::print("{}: {:.1f} vertices a point on average\n", rule,
               static_cast<double>(binding.transfer->matrix().nonZeros()) / std::max(bound.num_points, 1));
    return;
  }
  fmt::print("{}; {} of {} cells and {} of {} vertices used\n", rule, bound.num_active_cells, bound.num_cells,
             bound.num_active_vertices, bound.num_vertices);
  if (binding.on_surface()) {
    const json range = distance_range(binding.feet.distance);
    fmt::print("points lie {:.4g} to {:.4g} length units from the surface\n", range["least"].get<double>(),
               range["greatest"].get<double>());
  }
  if (!binding.embedding.outside.empty())
    fmt::print("{} points outside the mesh, {} length units away at most ({})\n", binding.embedding.outside.size(),
               bound.max_outside_distance,
               settings.outside == "nearest" ? "carried by the nearest cell" : "marked with NaN");
  if (!binding.quality.folded_cells.empty())
    fmt::print("{} cells of {} fold over themselves at rest\n", binding.quality.folded_cells.size(),
               settings.rest.string());
}

// What baselines cannot give: they have no gradients and no cells.
void refuse_for_baseline(const DeformOptions& options, const BindSettings& settings) {
  const std::array<std::pair<bool, const char*>, 5> given = {{{options.normals.has_value(), "--normals"},
                                                              {options.tangents, "--tangents"},
                                                              {options.gradients, "--gradients"},
                                                              {options.stretch, "--stretch"},
                                                              {options.tolerance > 0, "--tolerance"}}};
  for (const auto& [is_given, option] : given)
    if (is_given) raise("{}: {} knows vertices only and does not take it", option, settings.interpolant.name);
}

}  // namespace

void deform(const DeformOptions& given) {
  Stopwatch watch;
  DeformOptions options = given;
  // Names and options are checked before the first large file is read.
  const BindSettings settings = parse_settings(options.bind);
  options.bind.rest = settings.rest;
  options.bind.points = settings.points;
  if (settings.is_baseline()) refuse_for_baseline(options, settings);
  if (options.precision != "float" && options.precision != "double")
    raise("--precision {}: expected float or double", options.precision);
  if (!(options.tolerance >= 0)) raise("--tolerance {}: expected a length >= 0", options.tolerance);
  if (options.step < 1) raise("--step {}: expected 1 or more", options.step);
  for (const std::filesystem::path& input : {settings.rest, settings.points, std::filesystem::path(options.frames)}) {
    std::error_code ignored;
    if (std::filesystem::equivalent(options.out, input, ignored))
      raise("--out {} is also an input: name another file", options.out.string());
  }

  Binding binding = read_inputs(settings);
  const std::unique_ptr<FrameSource> source = open_frames(options.frames);
  if (source->num_vertices() != binding.num_vertices())
    raise("{}: frames of {} vertices, but {} has {}{}", options.frames, source->num_vertices(), settings.rest.string(),
          binding.num_vertices(),
          source->num_vertices() == binding.points.rows()
              ? fmt::format("; {} has as many: frames are those of the rest mesh, which moves the points (--rest and "
                            "--points exchanged?)",
                            settings.points.string())
              : "");
  if (binding.on_surface() && source->num_columns() != 3)
    raise("{}: frames of {} coordinates, but {} is a surface in space", options.frames, source->num_columns(),
          settings.rest.string());
  const FrameRange range = frame_range(options, *source);
  watch.lap("read");
  locate(settings, binding);
  watch.lap("locate");
  // Offsets from a surface follow its normals, whatever the rule.
  if (settings.interpolant.needs_gradients() || options.gradients || options.stretch || options.normals ||
      options.tangents || binding.on_surface())
    reconstruct(settings, binding);
  watch.lap("reconstruct");

  const Tally tally = options.precision == "float"
                          ? run_frames<float>(options, settings, binding, *source, range, watch)
                          : run_frames<double>(options, settings, binding, *source, range, watch);
  if (!options.report.empty()) {
    json report = report_of(options, settings, binding, tally);
    report["seconds"] = watch.seconds();
    write_text_atomically(options.report, report.dump(2) + "\n");
  }
  if (!options.quiet) print_summary(options, settings, binding, tally);
}

}  // namespace halfgrad::app
