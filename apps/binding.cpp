#include "apps/binding.hpp"

#include <fmt/format.h>

#include <nlohmann/json.hpp>

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

// Where the user names none: what the command prefers, on grids the rule that lists no cells, and the one that gives
// Hessians where they are needed.
json parse_reconstructor(const std::string& text, const InterpolationRule& rule, const std::filesystem::path& rest,
                         std::string_view preferred) {
  if (text.empty() && rule.needs_hessians()) return {{"kriging", {{"drift", "cubic"}}}};
  if (text.empty())
    return find_format(rest, FormatUse::read_mesh).read_grid != nullptr ? "centered_difference" : json(preferred);
  if ((text[0] != '{' && text[0] != '"')) return text;
  return parse_json(text, "--reconstructor");
}

Outside parse_outside(const std::string& word) {
  if (word == "error") return Outside::error;
  if (word == "nearest") return Outside::nearest;
  if (word == "mark") return Outside::mark;
  raise("--outside {}: expected error, nearest or mark", word);
}

InterpolationRule parse_rule(const std::string& interpolant, std::optional<double> alpha) {
  InterpolationRule rule = named_rule(interpolant);
  if (alpha) {
    if (interpolant != "vertex_blend")
      raise("--alpha {}: only vertex_blend takes it; {} has its own", *alpha, interpolant);
    rule.alpha = *alpha;
  }
  return rule;
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
  if (options.binding.empty()) {
    if (options.rest.empty() || options.points.empty())
      raise("{} is missing: give --rest and --points, or --binding with a file that halfgrad bind wrote",
            options.rest.empty() ? "--rest" : "--points");
    settings.interpolant = options.interpolant.value_or(alpha ? "vertex_blend" : "phong");
    settings.outside = options.outside.value_or("error");
  } else {
    json bound = json::parse(read_binding_settings(options.binding), nullptr, false);
    if (!bound.is_object()) raise("{}: the binding is damaged: its settings are no JSON", options.binding.string());
    const auto read = [&](const char* key) { return saved(bound, key, options.binding); };
    if (settings.rest.empty()) settings.rest = read("rest");
    if (settings.points.empty()) settings.points = read("points");
    settings.interpolant = read("interpolant");
    settings.outside = read("outside");
    if (options.interpolant) require_same(*options.interpolant, settings.interpolant, "--interpolant", options.binding);
    if (options.outside) require_same(*options.outside, settings.outside, "--outside", options.binding);
    if (!specification.empty()) {
      const json wanted =
          parse_reconstructor(specification, named_rule(settings.interpolant), settings.rest, preferred);
      require_same(wanted.dump(), read("reconstructor"), "--reconstructor", options.binding);
    }
    specification = read("reconstructor");
    if (bound.contains("alpha") && bound["alpha"].is_number()) {
      const double bound_alpha = bound["alpha"];
      if (alpha && *alpha != bound_alpha)
        raise("--alpha {}: {} was bound with {}; bind again", *alpha, options.binding.string(), bound_alpha);
      alpha = bound_alpha;
    }
  }
  settings.rule = parse_rule(settings.interpolant, alpha);
  parse_outside(settings.outside);
  const json parsed = parse_reconstructor(specification, settings.rule, settings.rest, preferred);
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
                 {"interpolant", interpolant},
                 {"outside", outside},
                 {"reconstructor", specification}};
  if (interpolant == "vertex_blend") result["alpha"] = rule.alpha;
  return result.dump();
}

Binding read_inputs(const BindSettings& settings) {
  Binding binding;
  RestShape rest = read_rest_shape(settings.rest);
  if (Grid* grid = std::get_if<Grid>(&rest)) {
    binding.grid = std::move(*grid);
  } else {
    binding.mesh = std::get<Mesh>(std::move(rest));
    binding.quality = inspect(binding.mesh);
    binding.faults = mesh_faults(binding.mesh, binding.quality);
  }
  settings.limits.check(settings.rest, binding.faults);
  if ((binding.grid || binding.on_surface()) && !settings.binding.empty())
    raise("{}: saved bindings are those of meshes that fill their space; grids and surfaces are bound anew",
          settings.rest.string());
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
  if (binding.on_surface()) {
    binding.feet = embed_on_surface(binding.mesh, binding.points);
    return;
  }
  if (settings.binding.empty()) {
    const EmbedOptions options{.outside = parse_outside(settings.outside)};
    binding.embedding =
        binding.grid ? embed(*binding.grid, binding.points, options) : embed(binding.mesh, binding.points, options);
  } else {
    SavedBinding saved =
        read_binding(settings.binding, binding.mesh, static_cast<Index>(binding.points.rows()), binding.fingerprint);
    binding.embedding = std::move(saved.embedding);
    binding.reconstruction = std::move(saved.reconstruction);
  }
  settings.limits.check(settings.points, point_faults(binding.embedding));
}

void reconstruct(const BindSettings& settings, Binding& binding) {
  if (!binding.reconstruction) {
    const MadeReconstructor made = make_reconstructor(json::parse(settings.specification), "--reconstructor");
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
  if (binding.grid || binding.on_surface())
    raise("{}: bindings are saved for meshes that fill their space; deform binds grids and surfaces itself",
          settings.rest.string());
  locate(settings, binding);
  if (settings.rule.needs_gradients()) reconstruct(settings, binding);
  write_binding(out, {settings.to_json(), binding.fingerprint, binding.embedding, binding.reconstruction});
  if (!report.empty()) {
    nlohmann::ordered_json facts = {{"version", version},
                                    {"rest", settings.rest.string()},
                                    {"points", settings.points.string()},
                                    {"out", out.string()},
                                    {"interpolant", settings.interpolant},
                                    {"reconstructor", json(nullptr)},
                                    {"options", json::parse(settings.reconstructor_options)},
                                    {"counts",
                                     {{"points", binding.embedding.num_points()},
                                      {"vertices", binding.num_vertices()},
                                      {"cells", binding.mesh.num_cells()}}}};
    if (settings.rule.needs_gradients()) facts["reconstructor"] = settings.reconstructor;
    facts.update(diagnosis(settings, binding));
    write_text_atomically(report, facts.dump(2) + "\n");
  }
  if (quiet) return;
  fmt::print("{} points bound to {} written to {}\n", binding.embedding.num_points(), settings.rest.string(),
             out.string());
  std::vector<Fault> faults = binding.faults;
  for (Fault& fault : point_faults(binding.embedding)) faults.push_back(std::move(fault));
  if (binding.reconstruction)
    for (Fault& fault : gradient_faults(binding.reconstruction->stencils)) faults.push_back(std::move(fault));
  fmt::print("{}", fault_lines(faults));
}

}  // namespace halfgrad::app
