#include "apps/binding.hpp"

#include <fmt/format.h>

#include <nlohmann/json.hpp>
#include <tuple>

#include "framework/cell_gradients.hpp"
#include "framework/error.hpp"
#include "framework/fingerprint.hpp"
#include "framework/interpolant.hpp"
#include "framework/io/binding_file.hpp"
#include "framework/io/formats.hpp"
#include "framework/io/mesh_file.hpp"
#include "framework/io/output_file.hpp"
#include "framework/json_values.hpp"
#include "framework/version.hpp"
#include "reconstruction/registry.hpp"
#include "reconstruction/surface_gradients.hpp"

namespace halfgrad::app {

using nlohmann::json;

namespace {

// A name, or JSON with options.
json parse_name(const std::string& text, const char* option) {
  if (text.empty() || (text[0] != '{' && text[0] != '"')) return text;
  return parse_json(text, option);
}

// Where the user names none: what the command prefers, on grids the rule that lists no cells, for baselines the
// paper's, and the one that gives Hessians where they are needed.
json parse_reconstructor(const std::string& text, const ConfiguredInterpolant& interpolant,
                         const std::filesystem::path& rest, std::string_view preferred) {
  if (!text.empty()) return parse_name(text, "--reconstructor");
  if (interpolant.needs_hessians()) return {{"kriging", {{"drift", "cubic"}}}};
  if (interpolant.scattered) return "chandrashekar_garg";
  return find_format(rest, FormatUse::read_mesh).read_grid != nullptr ? "centered_difference" : json(preferred);
}

Outside parse_outside(const std::string& word) {
  if (word == "error") return Outside::error;
  if (word == "nearest") return Outside::nearest;
  if (word == "mark") return Outside::mark;
  raise("--outside {}: expected error, nearest or mark", word);
}

// The interpolant and how a saved binding names it.
std::pair<ConfiguredInterpolant, std::string> parse_interpolant(const std::string& text, std::optional<double> alpha) {
  json resolved;
  ConfiguredInterpolant interpolant = read_interpolant(parse_name(text, "--interpolant"), "--interpolant", resolved);
  if (!interpolant.scattered && text != interpolant.name)
    raise("--interpolant {}: {} takes no options in JSON (vertex_blend takes --alpha)", text, interpolant.name);
  if (alpha) {
    if (interpolant.name != "vertex_blend")
      raise("--alpha {}: only vertex_blend takes it, not {}", *alpha, interpolant.name);
    interpolant.rule.alpha = *alpha;
  }
  std::string specification = interpolant.scattered ? resolved.dump() : interpolant.name;
  return {std::move(interpolant), std::move(specification)};
}

// The settings of a saved binding; `key` may be absent only in a damaged file.
std::string saved(const json& settings, const char* key, const std::filesystem::path& file) {
  const auto found = settings.find(key);
  if (found == settings.end() || !found->is_string())
    raise("{}: the binding is damaged: no \"{}\"", file.string(), key);
  return *found;
}

void require_same(const std::string& given, const std::string& bound, const char* option,
                  const std::filesystem::path& file) {
  if (given != bound) raise("{} {}: {} was bound with {}; bind again", option, given, file.string(), bound);
}

MadeReconstructor made_reconstructor(const BindSettings& settings) {
  return make_reconstructor(json::parse(settings.specification), "--reconstructor");
}

// Moves what a saved binding holds into this one.
void take_saved(const BindSettings& settings, Binding& binding) {
  const BindingSizes sizes{binding.gdim(), binding.num_vertices(), binding.num_cells(),
                           static_cast<Index>(binding.points.rows())};
  SavedBinding saved = read_binding(settings.binding, sizes, binding.fingerprint);
  const auto take = [&]<class T>(T) -> T {
    if (T* places = std::get_if<T>(&saved.places)) return std::move(*places);
    raise("{}: the binding is damaged: its points are not bound as its settings say", settings.binding.string());
  };
  if (binding.by_vertices) {
    binding.transfer = std::make_shared<const ScatteredTransfer>(ScatteredTransfer::from_weights(
        binding.mesh, binding.points, take(Eigen::SparseMatrix<double, Eigen::RowMajor>())));
  } else if (binding.on_surface()) {
    binding.feet = take(SurfaceEmbedding());
    binding.feet.points = binding.points;
  } else {
    binding.embedding = take(Embedding());
  }
  binding.reconstruction = std::move(saved.reconstruction);
}

}  // namespace

BindSettings parse_settings(const BindOptions& options, std::string_view preferred) {
  BindSettings settings;
  std::vector<std::string> limits = {"degenerate_cells=0"};
  limits.insert(limits.end(), options.limits.begin(), options.limits.end());
  settings.limits = Limits(limits);
  settings.binding = options.binding;
  settings.rest = options.rest;
  settings.points = options.points;
  std::optional<double> alpha = options.alpha;
  std::string specification = options.reconstructor;
  std::string interpolant = options.interpolant.value_or(alpha ? "vertex_blend" : "phong");
  std::string outside = options.outside.value_or("error");
  if (options.binding.empty()) {
    if (options.rest.empty() || options.points.empty())
      raise("{} is missing: give --rest and --points, or --binding with a file that halfgrad bind wrote",
            options.rest.empty() ? "--rest" : "--points");
  } else {
    json bound = json::parse(read_binding_settings(options.binding), nullptr, false);
    if (!bound.is_object()) raise("{}: the binding is damaged: its settings are no JSON", options.binding.string());
    const auto read = [&](const char* key) { return saved(bound, key, options.binding); };
    if (settings.rest.empty()) settings.rest = read("rest");
    if (settings.points.empty()) settings.points = read("points");
    interpolant = read("interpolant");
    outside = read("outside");
    if (options.interpolant)
      require_same(parse_interpolant(*options.interpolant, {}).second, interpolant, "--interpolant", options.binding);
    if (options.outside) require_same(*options.outside, outside, "--outside", options.binding);
    if (!specification.empty())
      require_same(parse_name(specification, "--reconstructor").dump(), read("reconstructor"), "--reconstructor",
                   options.binding);
    specification = read("reconstructor");
    if (bound.contains("alpha") && bound["alpha"].is_number()) {
      const double bound_alpha = bound["alpha"];
      if (alpha && *alpha != bound_alpha)
        raise("--alpha {}: {} was bound with {}; bind again", *alpha, options.binding.string(), bound_alpha);
      alpha = bound_alpha;
    }
  }
  std::tie(settings.interpolant, settings.interpolant_specification) = parse_interpolant(interpolant, alpha);
  if (settings.is_baseline()) {
    if (options.outside && options.binding.empty())
      raise("--outside: {} knows vertices only and carries points wherever they lie", settings.interpolant.name);
  } else {
    parse_outside(outside);
    settings.outside = outside;
  }
  const json parsed = parse_reconstructor(specification, settings.interpolant, settings.rest, preferred);
  const MadeReconstructor made = make_reconstructor(parsed, "--reconstructor");
  settings.specification = parsed.dump();
  settings.reconstructor = made.name;
  settings.reconstructor_options = made.options;
  return settings;
}

std::string BindSettings::to_json() const {
  // Absolute, so that the binding can be used from any folder.
  json result = {{"rest", std::filesystem::absolute(rest).string()},
                 {"points", std::filesystem::absolute(points).string()},
                 {"interpolant", interpolant_specification},
                 {"outside", outside},
                 {"reconstructor", specification}};
  if (interpolant.name == "vertex_blend") result["alpha"] = interpolant.rule.alpha;
  return result.dump();
}

Binding read_inputs(const BindSettings& settings) {
  Binding binding;
  binding.by_vertices = settings.is_baseline();
  RestShape rest = binding.by_vertices ? RestShape(read_mesh(settings.rest)) : read_rest_shape(settings.rest);
  if (Grid* grid = std::get_if<Grid>(&rest)) {
    binding.grid = std::move(*grid);
  } else {
    binding.mesh = std::get<Mesh>(std::move(rest));
    binding.quality = inspect(binding.mesh);
    binding.faults = mesh_faults(binding.mesh, binding.quality);
  }
  // Baselines ask nothing of cells.
  if (!binding.by_vertices) settings.limits.check(settings.rest, binding.faults);
  binding.surface = read_points(settings.points);
  binding.points = in_dimension(binding.surface.points, binding.gdim(), settings.points.string());
  Fingerprint print;
  if (binding.grid) {
    for (Index v = 0; v < binding.grid->num_vertices(); ++v) print.add(Points(binding.grid->position(v).transpose()));
  } else {
    print.add(binding.mesh);
  }
  binding.fingerprint = print.add(binding.points).text();
  return binding;
}

void locate(const BindSettings& settings, Binding& binding) {
  if (!settings.binding.empty()) {
    take_saved(settings, binding);
  } else if (binding.by_vertices) {
    std::optional<MadeReconstructor> made;
    if (settings.interpolant.needs_gradients()) made = made_reconstructor(settings);
    binding.transfer = std::make_shared<const ScatteredTransfer>(
        binding.mesh, binding.points, *settings.interpolant.scattered, made ? made->reconstructor.get() : nullptr);
  } else if (binding.on_surface()) {
    binding.feet = embed_on_surface(binding.mesh, binding.points);
  } else {
    const EmbedOptions options{.outside = parse_outside(settings.outside)};
    binding.embedding =
        binding.grid ? embed(*binding.grid, binding.points, options) : embed(binding.mesh, binding.points, options);
  }
  settings.limits.check(settings.points, point_faults(binding.embedding));
}

void reconstruct(const BindSettings& settings, Binding& binding) {
  if (binding.by_vertices) return;
  if (!binding.reconstruction) {
    const MadeReconstructor made = made_reconstructor(settings);
    const VertexGradientReconstructor& reconstructor = *made.reconstructor;
    if (binding.grid)
      binding.reconstruction =
          reconstructor.reconstruct_on_grid(*binding.grid, active_vertices(*binding.grid, binding.embedding));
    else if (binding.on_surface())
      binding.reconstruction = surface_gradients(reconstructor, binding.mesh, active_vertices(binding.feet.feet));
    else
      binding.reconstruction =
          reconstructor.reconstruct(CellGradients(binding.mesh), active_vertices(binding.mesh, binding.embedding));
  }
  settings.limits.check(settings.rest, gradient_faults(binding.reconstruction->stencils));
}

nlohmann::ordered_json rule_facts(const BindSettings& settings) {
  const ConfiguredInterpolant& interpolant = settings.interpolant;
  nlohmann::ordered_json facts = {{"interpolant", interpolant.name},
                                  {"interpolant_options", json::object()},
                                  {"alpha", nullptr},
                                  {"reconstructor", nullptr},
                                  {"options", json::object()}};
  if (settings.is_baseline())
    facts["interpolant_options"] = json::parse(interpolant.options);
  else if (interpolant.rule.formula == Formula::blend)
    facts["alpha"] = interpolant.rule.alpha;
  if (interpolant.needs_gradients()) {
    facts["reconstructor"] = settings.reconstructor;
    facts["options"] = json::parse(settings.reconstructor_options);
  }
  return facts;
}

nlohmann::ordered_json diagnosis(const BindSettings& settings, const Binding& binding) {
  nlohmann::ordered_json result;
  if (!binding.grid) {
    result["mesh"] = to_json(binding.faults);
    result["mesh"]["min_quality"] = binding.quality.min_quality;
  }
  if (binding.reconstruction) {
    result["vertex_rules"] = rule_counts(binding.reconstruction->stencils);
    result["vertices_by_rule"] = vertices_by_rule(binding.reconstruction->stencils);
  }
  if (binding.by_vertices) return result;
  double farthest = 0;
  nlohmann::ordered_json points = nlohmann::ordered_json::array();
  for (const OutsidePoint& outside : binding.embedding.outside) {
    farthest = std::max(farthest, outside.distance);
    points.push_back({{"point", outside.point}, {"distance", outside.distance}});
  }
  result["outside"] = {{"policy", settings.outside},
                       {"count", binding.embedding.outside.size()},
                       {"max_distance", farthest},
                       {"points", points}};
  return result;
}

void save_binding(const BindOptions& options, const std::filesystem::path& out, const std::filesystem::path& report,
                  bool quiet) {
  if (out.extension() != ".hgb") raise("--out {}: expected a name that ends in .hgb", out.string());
  const BindSettings settings = parse_settings(options);
  Binding binding = read_inputs(settings);
  locate(settings, binding);
  // Offsets from a surface follow its normals, whatever the rule.
  if (settings.interpolant.needs_gradients() || binding.on_surface()) reconstruct(settings, binding);
  SavedBinding saved{settings.to_json(), binding.fingerprint, binding.embedding, binding.reconstruction};
  if (binding.by_vertices)
    saved.places = binding.transfer->matrix();
  else if (binding.on_surface())
    saved.places = binding.feet;
  write_binding(out, saved);
  if (!report.empty()) {
    nlohmann::ordered_json facts = {{"version", version},
                                    {"rest", settings.rest.string()},
                                    {"points", settings.points.string()},
                                    {"out", out.string()}};
    facts.update(rule_facts(settings));
    facts["counts"] = {
        {"points", binding.points.rows()}, {"vertices", binding.num_vertices()}, {"cells", binding.num_cells()}};
    facts.update(diagnosis(settings, binding));
    write_text_atomically(report, facts.dump(2) + "\n");
  }
  if (quiet) return;
  fmt::print("{} points bound to {} written to {}\n", binding.points.rows(), settings.rest.string(), out.string());
  std::vector<Fault> faults = binding.faults;
  for (Fault& fault : point_faults(binding.embedding)) faults.push_back(std::move(fault));
  if (binding.reconstruction)
    for (Fault& fault : gradient_faults(binding.reconstruction->stencils)) faults.push_back(std::move(fault));
  fmt::print("{}", fault_lines(faults));
}

}  // namespace halfgrad::app
