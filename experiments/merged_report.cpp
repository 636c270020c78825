#include "experiments/merged_report.hpp"

#include <fstream>
#include <nlohmann/json.hpp>
#include <sstream>

#include "experiments/html_report.hpp"
#include "experiments/interactive_report.hpp"
#include "framework/error.hpp"
#include "framework/io/output_file.hpp"
#include "framework/json_values.hpp"

namespace halfgrad {

using nlohmann::json;

namespace {

std::string read_text(const std::filesystem::path& path) {
  std::ifstream file(path, std::ios::binary);
  if (!file) raise("{}: cannot be read", path.string());
  std::ostringstream text;
  text << file.rdbuf();
  return text.str();
}

template <class Number>
std::optional<Number> read_optional(const json& value) {
  if (value.is_null()) return std::nullopt;
  return value.get<Number>();
}

/// NaN is written as null.
double read_number(const json& value) {
  return value.is_null() ? std::numeric_limits<double>::quiet_NaN() : value.get<double>();
}

std::string read_name(const json& value) { return value.is_null() ? "" : value.get<std::string>(); }

template <class Names>
int position_of(const Names& names, const std::string& name) {
  return static_cast<int>(std::find(names.begin(), names.end(), name) - names.begin());
}

ResultRow read_row(const json& entry) {
  ResultRow row;
  row.level = entry.at("level");
  row.element = entry.at("element");
  row.vertices = entry.at("vertices");
  row.cells = entry.at("cells");
  row.h = entry.at("h");
  row.points = entry.at("points");
  row.frame = entry.at("frame");
  row.interpolant = entry.at("interpolant");
  row.alpha = read_optional<double>(entry.at("alpha"));
  row.reconstructor = read_name(entry.at("reconstructor"));
  row.options = entry.at("options").dump();
  for (std::size_t r = 0; r < region_names.size(); ++r) {
    const json& error = entry.at("error").at(region_names[r]);
    row.error[r].max = read_number(error.at("max"));
    row.error[r].rms = read_number(error.at("rms"));
    row.error[r].mean = read_number(error.value("mean", json()));
    row.error[r].points = error.at("points");
    row.gain_over_linear[r] = read_optional<double>(entry.at("gain_over_linear").at(region_names[r]));
  }
  row.max_abs_sum = read_optional<double>(entry.at("weights").at("max_abs_sum"));
  row.sigma = read_optional<double>(entry.at("weights").at("sigma"));
  const json& seconds = entry.at("seconds");
  row.locate_seconds = seconds.at("locate");
  row.reconstruct_seconds = seconds.at("reconstruct");
  row.gradients_seconds = seconds.at("gradients");
  row.evaluate_seconds = seconds.at("evaluate");
  return row;
}

ExperimentResult parse_results(const std::string& text) {
  const json document = parse_json(text, "results.json");
  ExperimentResult result;
  result.name = document.at("name");
  result.config = document.at("config").dump();
  result.machine = document.at("machine").dump();
  for (const json& row : document.at("rows")) result.rows.push_back(read_row(row));
  for (const json& entry : document.at("orders"))
    result.orders.push_back({entry.at("interpolant"), read_name(entry.at("reconstructor")), entry.at("options").dump(),
                             static_cast<Region>(position_of(region_names, entry.at("region"))),
                             static_cast<Norm>(position_of(norm_names, entry.at("norm"))), entry.at("slope")});
  for (const json& entry : document.at("expect"))
    result.expectations.push_back({entry.at("expect").dump(), entry.at("bound"), entry.at("limit"),
                                   read_number(entry.at("measured")), entry.at("matches"), entry.at("holds")});
  if (result.rows.empty()) raise("no rows");
  return result;
}

/// `parse` of a file's text, with the file's name in whatever it throws.
ExperimentResult parse_file(const std::filesystem::path& file, const std::string& text) {
  try {
    return parse_results(text);
  } catch (const json::exception& error) {
    raise("{}: not the results of a run: {}", file.string(), error.what());
  } catch (const Error& error) {
    raise("{}: not the results of a run: {}", file.string(), error.what());
  }
}

}  // namespace

ExperimentResult read_results(const std::filesystem::path& file) { return parse_file(file, read_text(file)); }

void write_merged_report(std::span<const std::filesystem::path> folders, const std::filesystem::path& out) {
  std::vector<ExperimentResult> results;
  std::vector<ReportedRun> runs;
  for (const std::filesystem::path& folder : folders) {
    const std::filesystem::path file = folder / "results.json", scene = folder / "scene.json";
    if (!std::filesystem::exists(file))
      raise("{}: has no results.json; expected a folder that halfgrad run wrote", folder.string());
    ReportedRun run{read_text(file), std::filesystem::exists(scene) ? read_text(scene) : ""};
    results.push_back(parse_file(file, run.results));
    if (!run.scene.empty() && !json::accept(run.scene)) raise("{}: not JSON", scene.string());
    runs.push_back(std::move(run));
  }
  const std::string title = results.size() == 1 ? results[0].name : fmt::format("{} runs", results.size());
  write_text_atomically(out, report_script().empty() ? results_html(title, results) : interactive_html(title, runs));
}

}  // namespace halfgrad
