#include "experiments/report.hpp"

#include <charconv>
#include <fstream>
#include <map>
#include <nlohmann/json.hpp>
#include <thread>

#include "experiments/experiment.hpp"
#include "framework/error.hpp"
#include "framework/io/output_file.hpp"
#include "framework/io/vtk_output.hpp"
#include "framework/version.hpp"

namespace halfgrad {

using nlohmann::json;

namespace {

template <class Number>
json or_null(const std::optional<Number>& value) {
  return value ? json(*value) : json(nullptr);
}

json row_json(const ResultRow& row) {
  json error, gain;
  for (int r = 0; r < 3; ++r) {
    const std::string region(region_names[r]);
    error[region] = {{"max", row.error[r].max},
                     {"rms", row.error[r].rms},
                     {"mean", row.error[r].mean},
                     {"points", row.error[r].points}};
    gain[region] = or_null(row.gain_over_linear[r]);
  }
  return {{"level", row.level},
          {"element", row.element},
          {"vertices", row.vertices},
          {"cells", row.cells},
          {"h", row.h},
          {"points", row.points},
          {"frame", row.frame},
          {"interpolant", row.interpolant},
          {"alpha", or_null(row.alpha)},
          {"reconstructor", row.reconstructor.empty() ? json(nullptr) : json(row.reconstructor)},
          {"options", json::parse(row.options.empty() ? "{}" : row.options)},
          {"error", error},
          {"gain_over_linear", gain},
          {"weights", {{"max_abs_sum", or_null(row.max_abs_sum)}, {"sigma", or_null(row.sigma)}}},
          {"seconds",
           {{"locate", row.locate_seconds},
            {"reconstruct", row.reconstruct_seconds},
            {"gradients", row.gradients_seconds},
            {"evaluate", row.evaluate_seconds}}},
          {"skipped",
           {{"cells", row.skipped_cells},
            {"vertices", row.skipped_vertices},
            {"linear_cells", row.linear_cells},
            {"outside_points", row.outside_points}}}};
}

json rule_json(const MeasuredRule& rule) {
  return {{"interpolant", rule.interpolant},
          {"reconstructor", rule.reconstructor.empty() ? json(nullptr) : json(rule.reconstructor)},
          {"options", json::parse(rule.options.empty() ? "{}" : rule.options)},
          {"gain_over_linear", rule.gain}};
}

json recommendation_json(const Recommendation& recommendation) {
  json object = rule_json(recommendation.chosen);
  object["reason"] = recommendation.reason;
  object["points"] = recommendation.points;
  object["frames"] = recommendation.frames;
  object["best"] = rule_json(recommendation.best);
  object["safe"] = recommendation.safe ? rule_json(*recommendation.safe) : json(nullptr);
  return object;
}

/// Shortest digits that read back bit for bit.
std::string digits(double value) {
  char buffer[32];
  return {buffer, std::to_chars(buffer, buffer + sizeof buffer, value).ptr};
}

std::string digits(const std::optional<double>& value) { return value ? digits(*value) : ""; }

std::string quoted(const std::string& text) {
  std::string result = "\"";
  for (const char c : text) result += c == '"' ? "\"\"" : std::string(1, c);
  return result + '"';
}

/// "phong chandrashekar_garg", numbered where a configuration names a pair more than once.
class ArrayNames {
 public:
  std::string operator()(const std::string& name) {
    const int use = ++uses_[name];
    return use == 1 ? name : fmt::format("{} {}", name, use);
  }

 private:
  std::map<std::string, int> uses_;
};

}  // namespace

std::string results_json(const ExperimentResult& result) {
  json rows = json::array(), orders = json::array(), expectations = json::array();
  for (const ResultRow& row : result.rows) rows.push_back(row_json(row));
  for (const ResultOrder& order : result.orders)
    orders.push_back({{"interpolant", order.interpolant},
                      {"reconstructor", order.reconstructor.empty() ? json(nullptr) : json(order.reconstructor)},
                      {"options", json::parse(order.options.empty() ? "{}" : order.options)},
                      {"region", region_names[static_cast<int>(order.region)]},
                      {"norm", norm_names[static_cast<int>(order.norm)]},
                      {"slope", order.slope}});
  for (const ResultExpectation& expected : result.expectations)
    expectations.push_back({{"expect", json::parse(expected.text)},
                            {"bound", expected.bound},
                            {"limit", expected.limit},
                            {"measured", expected.measured},
                            {"matches", expected.matches},
                            {"holds", expected.holds}});
  json document = {{"name", result.name},
                   {"version", version},
                   {"config", json::parse(result.config)},
                   {"machine", json::parse(result.machine)},
                   {"rows", rows},
                   {"orders", orders},
                   {"expect", expectations}};
  if (result.recommendation) document["recommendation"] = recommendation_json(*result.recommendation);
  return document.dump(1) + "\n";
}

std::string results_csv(const ExperimentResult& result) {
  std::string text =
      "level,element,vertices,cells,h,points,frame,interpolant,alpha,reconstructor,options,error_all_max,"
      "error_all_rms,error_all_points,error_interior_max,error_interior_rms,error_interior_points,error_boundary_max,"
      "error_boundary_rms,error_boundary_points,gain_over_linear_all,gain_over_linear_interior,"
      "gain_over_linear_boundary,weights_max_abs_sum,weights_sigma,seconds_locate,seconds_reconstruct,"
      "seconds_gradients,seconds_evaluate,skipped_cells,skipped_vertices,skipped_linear_cells,"
      "skipped_outside_points\n";
  for (const ResultRow& row : result.rows) {
    text += fmt::format("{},{},{},{},{},{},{},{},{},{},{}", row.level, row.element, row.vertices, row.cells,
                        digits(row.h), row.points, row.frame, row.interpolant, digits(row.alpha), row.reconstructor,
                        quoted(row.options.empty() ? "{}" : row.options));
    for (const RegionError& error : row.error)
      text += fmt::format(",{},{},{}", digits(error.max), digits(error.rms), error.points);
    for (const auto& gain : row.gain_over_linear) text += "," + digits(gain);
    text += fmt::format(",{},{},{},{},{},{},{},{},{},{}\n", digits(row.max_abs_sum), digits(row.sigma),
                        digits(row.locate_seconds), digits(row.reconstruct_seconds), digits(row.gradients_seconds),
                        digits(row.evaluate_seconds), row.skipped_cells, row.skipped_vertices, row.linear_cells,
                        row.outside_points);
  }
  return text;
}

std::string machine_facts() {
  std::string processor = "unknown";
  std::ifstream cpuinfo("/proc/cpuinfo");
  for (std::string line; std::getline(cpuinfo, line);)
    if (line.starts_with("model name")) {
      processor = line.substr(std::min(line.size(), line.find(':') + 2));
      break;
    }
  return json{
      {"processor", processor}, {"hardware_threads", std::thread::hardware_concurrency()}, {"compiler", __VERSION__}}
      .dump();
}

void write_pictures(const std::filesystem::path& directory, const LevelPicture& picture,
                    std::vector<std::string>& files) {
  std::vector<PointArray> arrays;
  ArrayNames stencil_names;
  for (const auto& [name, table] : picture.stencils) {
    if (table.diagnostics.empty()) continue;
    const std::string unique = stencil_names(name);
    // Vertices that no point needs have no stencil: −1 marks them.
    std::array<std::pair<const char*, Values<double>>, 5> columns;
    constexpr std::array titles = {"rule", "points", "smallest singular value", "absolute sum", "expected error"};
    for (int q = 0; q < 5; ++q) columns[q] = {titles[q], Values<double>::Constant(picture.mesh.num_vertices(), 1, -1)};
    for (std::size_t row = 0; row < table.vertices.size() && row < table.diagnostics.size(); ++row) {
      const StencilDiagnostics& diagnostics = table.diagnostics[row];
      const std::array<double, 5> values = {double(diagnostics.rule), double(diagnostics.num_points),
                                            diagnostics.smallest_singular_value, diagnostics.absolute_sum,
                                            diagnostics.expected_error};
      for (int q = 0; q < 5; ++q) columns[q].second(table.vertices[row], 0) = values[q];
    }
    for (auto& [title, values] : columns) arrays.push_back({unique + ": " + title, std::move(values)});
  }
  const std::filesystem::path stencils = directory / "stencils.vtu", points = directory / "errors.vtp";
  write_vtu(stencils, picture.mesh, arrays);
  files.push_back(stencils.string());

  std::vector<PointArray> errors;
  ArrayNames rule_names;
  for (const auto& [row, error] : picture.errors)
    errors.push_back(
        {rule_names(row.reconstructor.empty() ? row.interpolant : row.interpolant + " " + row.reconstructor), error});
  write_vtp(points, picture.cloud.positions, picture.cloud.faces, errors);
  files.push_back(points.string());
}

void write_report(const std::filesystem::path& path, const std::string& text, std::vector<std::string>& files) {
  write_text_atomically(path, text);
  files.push_back(path.string());
}

}  // namespace halfgrad
