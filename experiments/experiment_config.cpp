#include "experiments/experiment_config.hpp"

#include <algorithm>
#include <nlohmann/json.hpp>

#include "framework/error.hpp"
#include "framework/io/input_file.hpp"
#include "framework/json_values.hpp"

namespace halfgrad {

using nlohmann::json;

namespace {

json read_json_file(const std::filesystem::path& path) {
  const InputFile file(path);
  return parse_json(file.bytes(), path.string());
}

void apply_override(json& config, const std::string& text) {
  const std::size_t equals = text.find('=');
  if (equals == std::string::npos || text[0] != '/') raise("--set: found \"{}\", expected /json/pointer=VALUE", text);
  const std::string pointer = text.substr(0, equals), value = text.substr(equals + 1);
  json parsed;
  try {
    parsed = parse_json(value, text);
  } catch (const Error&) {
    parsed = value;
  }
  try {
    parsed.dump();  // throws where a text is not UTF-8
    config[json::json_pointer(pointer)] = std::move(parsed);
  } catch (const json::exception& error) {
    raise("--set {}: no such place in the configuration ({})", pointer, error.what());
  }
}

std::vector<json> read_list(JsonReader& reader, std::string_view key, json fallback) {
  const json* value = reader.find(key);
  const json& list = value != nullptr ? *value : fallback;
  if (!list.is_array() || list.empty())
    raise("{}: found {}, expected an array with at least one entry", reader.pointer_to(key), list.dump());
  return {list.begin(), list.end()};
}

/// The registry's reconstructors, and `exact`, which takes the field itself.
MadeReconstructor read_reconstructor(const json& specification, const std::string& pointer, bool has_field,
                                     std::span<const ReconstructorEntry> further) {
  const bool is_exact = specification == "exact" ||
                        (specification.is_object() && specification.size() == 1 && specification.contains("exact"));
  if (!is_exact) return make_reconstructor(specification, pointer, further);
  if (specification.is_object()) JsonReader(specification["exact"], pointer + "/exact").finish();
  if (!has_field) raise("{}: exact gradients need an analytic field, but the frames come from files", pointer);
  return {"exact", "{}", nullptr};
}

FrameFiles read_frame_files(const json& specification, const std::string& pointer, int num_levels, bool with_truth,
                            const std::filesystem::path& directory, json& resolved) {
  JsonReader reader(specification, pointer);
  FrameFiles files;
  files.frames = read_paths(reader.at("frames"), reader.pointer_to("frames"), directory);
  if (static_cast<int>(files.frames.size()) != num_levels)
    raise("{}: found {} files, expected one for each of the {} meshes", reader.pointer_to("frames"),
          files.frames.size(), num_levels);
  if (with_truth) files.truth = directory / reader.text("truth");
  if (const json* select = reader.find("select")) {
    if (!select->is_array() || select->empty())
      raise("{}: found {}, expected an array of frame numbers", reader.pointer_to("select"), select->dump());
    for (std::size_t i = 0; i < select->size(); ++i)
      files.select.push_back(small_integer((*select)[i], fmt::format("{}/{}", reader.pointer_to("select"), i)));
  }
  reader.finish();
  resolved = reader.resolved();
  return files;
}

/// The field frame by frame, one of its numbers growing in equal steps from zero (left out) to its value.
std::vector<std::unique_ptr<Field>> read_sequence(const json& specification, const json& field,
                                                  const FieldSetting& setting, json& resolved) {
  JsonReader reader(specification, "/sequence");
  const std::int64_t frames = reader.integer("frames", 8);
  if (frames < 1 || frames > 10000) raise("/sequence/frames: found {}, expected 1 to 10000", frames);
  const std::string parameter = reader.text("parameter");
  reader.finish();
  resolved = reader.resolved();
  const std::string name = field.begin().key();
  const json& options = field.begin().value();
  const auto entry = options.find(parameter);
  if (entry == options.end() || !entry->is_number())
    raise("/sequence/parameter: \"{}\" is no number of the field {}: {}", parameter, name, options.dump());
  std::vector<std::unique_ptr<Field>> fields;
  for (std::int64_t frame = 1; frame <= frames; ++frame) {
    json scaled = field;
    scaled[name][parameter] = entry->get<double>() * static_cast<double>(frame) / static_cast<double>(frames);
    fields.push_back(make_field(scaled, "/field", setting));
  }
  return fields;
}

std::vector<OutputKind> read_outputs(JsonReader& reader) {
  constexpr std::array<std::string_view, 5> known = {"json", "csv", "html", "vtu", "sequence"};
  std::vector<OutputKind> outputs;
  const std::vector<json> list = read_list(reader, "outputs", json::array({"json", "csv"}));
  for (std::size_t i = 0; i < list.size(); ++i) {
    const auto found = std::find_if(known.begin(), known.end(), [&](std::string_view name) { return list[i] == name; });
    if (found == known.end())
      raise("{}/{}: found {}, expected one of {}", reader.pointer_to("outputs"), i, list[i].dump(),
            join_names({known.begin(), known.end()}));
    outputs.push_back(static_cast<OutputKind>(found - known.begin()));
  }
  reader.record("outputs", list);
  return outputs;
}

/// The number of folds of "hold_out", 0 where it is absent.
int read_folds(JsonReader& reader, const MeshSource& mesh) {
  const json* specification = reader.find("hold_out");
  if (specification == nullptr) return 0;
  if (reader.has("points"))
    raise("/points: with \"hold_out\" the points are vertices of the mesh; leave one of them out");
  if (mesh.num_levels != 1) raise("/hold_out: found {} levels of the mesh, expected one", mesh.num_levels);
  JsonReader options(*specification, "/hold_out");
  const std::int64_t folds = options.integer("folds", 4);
  if (folds < 1 || folds > 100) raise("/hold_out/folds: found {}, expected 1 to 100", folds);
  options.finish();
  reader.record("hold_out", options.resolved());
  return static_cast<int>(folds);
}

ExperimentConfig read_config(const json& document, const std::filesystem::path& directory, const std::string& stem,
                             std::span<const ReconstructorEntry> further) {
  JsonReader reader(document, "");
  ExperimentConfig config;
  config.name = reader.text("name", stem);
  reader.text("description", "");
  reader.find("reduced");
  const std::int64_t seed = reader.integer("seed", 1);
  if (seed < 0) raise("/seed: found {}, expected 0 or more", seed);
  config.seed = static_cast<std::uint64_t>(seed);

  json resolved;
  config.mesh = read_mesh_source(reader.at("mesh"), "/mesh", directory, config.seed, resolved);
  reader.record("mesh", resolved);
  config.num_folds = read_folds(reader, config.mesh);
  if (config.num_folds == 0) {
    config.points = read_point_source(reader.has("points") ? reader.at("points") : json{{"random", json::object()}},
                                      "/points", directory, config.seed, resolved);
    reader.record("points", resolved);
  }

  const json& field = reader.at("field");
  if (field.is_object() && (field.contains("frames") || field.contains("truth"))) {
    config.files =
        read_frame_files(field, "/field", config.mesh.num_levels, config.num_folds == 0, directory, resolved);
  } else {
    // Only the file knows the dimension of a mesh that is read.
    if (config.mesh.gdim == 0) config.mesh.gdim = config.mesh.make(0).gdim();
    const FieldSetting setting{config.mesh.gdim, config.seed};
    config.fields.push_back(make_field(field, "/field", setting, &resolved));
    if (const json* sequence = reader.find("sequence")) {
      json filled;
      config.fields = read_sequence(*sequence, resolved, setting, filled);
      reader.record("sequence", filled);
    }
  }
  reader.record("field", resolved);

  std::vector<json> filled;
  for (const json& entry : read_list(reader, "interpolants", json::array({"linear", "phong"}))) {
    const std::string pointer = fmt::format("/interpolants/{}", filled.size());
    config.interpolants.push_back(read_interpolant(entry, pointer, filled.emplace_back()));
  }
  reader.record("interpolants", filled);
  filled.clear();
  for (const json& entry : read_list(reader, "reconstructors", json::array({"chandrashekar_garg"}))) {
    config.reconstructors.push_back(
        read_reconstructor(entry, fmt::format("/reconstructors/{}", filled.size()), !config.fields.empty(), further));
    const MadeReconstructor& made = config.reconstructors.back();
    filled.push_back(json{{made.name, json::parse(made.options)}});
  }
  reader.record("reconstructors", filled);

  const std::string outside = reader.choice("outside", {"error", "nearest", "mark"}, "error");
  config.outside = outside == "error" ? Outside::error : outside == "nearest" ? Outside::nearest : Outside::mark;
  config.tolerance = reader.number("tolerance", 0);
  if (config.tolerance < 0) raise("/tolerance: found {}, expected 0 or a positive length", config.tolerance);
  const json timing_object = reader.has("timing") ? reader.at("timing") : json::object();
  JsonReader timing(timing_object, "/timing");
  const std::int64_t repetitions = timing.integer("repetitions", 1);
  if (repetitions < 1 || repetitions > 10000) raise("/timing/repetitions: found {}, expected 1 to 10000", repetitions);
  config.repetitions = static_cast<int>(repetitions);
  timing.finish();
  reader.record("timing", timing.resolved());
  if (const json* expect = reader.find("expect")) config.expectations = read_expectations(*expect, "/expect");
  config.outputs = read_outputs(reader);
  reader.finish();
  json full = reader.resolved();
  full.erase("reduced");
  config.resolved = full.dump();
  return config;
}

}  // namespace

ExperimentConfig read_experiment_config(const std::filesystem::path& path, const std::vector<std::string>& overrides,
                                        bool reduced, std::span<const ReconstructorEntry> reconstructors) {
  json document = read_json_file(path);
  if (reduced && document.is_object() && document.contains("reduced")) {
    const json changes = document["reduced"];
    if (!changes.is_object()) raise("{}: /reduced: found {}, expected an object", path.string(), changes.dump());
    document.merge_patch(changes);
  }
  for (const std::string& text : overrides) apply_override(document, text);
  try {
    return read_config(document, path.parent_path(), path.stem().string(), reconstructors);
  } catch (const Error& error) {
    raise("{}: {}", path.string(), error.what());
  }
}

}  // namespace halfgrad
