#include <fmt/format.h>

#include <nlohmann/json.hpp>

#include "experiments/report.hpp"
#include "experiments/stress.hpp"
#include "experiments/svg_chart.hpp"
#include "framework/version.hpp"

namespace halfgrad {

using json = nlohmann::ordered_json;

namespace {

constexpr const char* style_sheet = R"(
body { font: 15px/1.5 system-ui, sans-serif; color: #1a1a1a; background: #fff; max-width: 1180px; margin: 2em auto; padding: 0 1em; }
table { border-collapse: collapse; font-variant-numeric: tabular-nums; }
th, td { padding: .2em .6em; text-align: right; border-bottom: 1px solid #ddd; }
th { border-bottom: 2px solid #888; } th:first-child, td:first-child, td.text { text-align: left; }
td.fails { color: #b32d00; font-weight: 700; } .scroll { overflow-x: auto; } svg { max-width: 620px; }
.grid { stroke: #e4e4e4; } .frame { fill: none; stroke: #888; }
)";

// JSON has no infinity: null stands for it.
json tally_json(const StressTally& tally, std::string_view element) {
  return {{"checks", tally.checks},
          {"worst", tally.worst},
          {"seed", tally.seed},
          {"where", tally.where},
          {"command", tally.checks > 0 ? json(stress_command(element, tally.seed)) : json(nullptr)}};
}

std::string stress_json(const StressResult& result) {
  json document = {{"version", version},
                   {"machine", json::parse(machine_facts())},
                   {"seed", result.seed},
                   {"seconds", result.seconds},
                   {"failures", result.num_failures},
                   {"properties", json::object()},
                   {"elements", json::array()},
                   {"failed", json::array()}};
  for (const StressPropertyEntry& entry : stress_properties())
    document["properties"][std::string(entry.name)] = entry.promise;
  for (const StressElement& element : result.elements) {
    json row = {{"element", element.element},       {"cases", element.num_cases}, {"refused", element.num_refused},
                {"vertices", element.num_vertices}, {"cells", element.num_cells}, {"points", element.num_points}};
    for (std::size_t p = 0; p < num_stress_properties; ++p)
      row["properties"][std::string(stress_properties()[p].name)] = tally_json(element.tallies[p], element.element);
    row["kriging_error_over_linear"] = tally_json(element.linear_ratio, element.element);
    row["damped_norm"] = tally_json(element.damped_norm, element.element);
    document["elements"].push_back(row);
  }
  for (const StressFailure& failure : result.failures)
    document["failed"].push_back({{"element", failure.element},
                                  {"property", stress_properties()[static_cast<std::size_t>(failure.property)].name},
                                  {"ratio", failure.ratio},
                                  {"where", failure.where},
                                  {"recipe", failure.recipe},
                                  {"command", stress_command(failure.element, failure.seed)}});
  return document.dump(1) + "\n";
}

std::string ratio_text(const StressTally& tally) {
  return tally.checks == 0 ? "–" : fmt::format("{:.2g}", tally.worst);
}

std::string stress_html(const StressResult& result) {
  std::string html = fmt::format(
      "<!DOCTYPE html>\n<html lang='en'><head><meta charset='utf-8'><meta name='viewport' content='width=device-width'>"
      "<title>Stress test</title><style>{}</style></head><body><h1>Stress test: {}</h1><p>halfgrad {}, cases from seed "
      "{} on, {:.0f} s. A number is the worst error over its bound: 1 or less holds. Hovering shows where; a failed "
      "number's command repeats it.</p>",
      style_sheet, result.passed() ? "all hold" : fmt::format("{} failures", result.num_failures), version, result.seed,
      result.seconds);

  html += "<div class='scroll'><table><tr><th>property</th>";
  for (const StressElement& element : result.elements) html += fmt::format("<th>{}</th>", element.element);
  html += "<th>checks</th></tr>";
  for (std::size_t p = 0; p < num_stress_properties; ++p) {
    html += fmt::format("<tr><td title='{}'>{}</td>", escaped(std::string(stress_properties()[p].promise)),
                        stress_properties()[p].name);
    std::int64_t checks = 0;
    for (const StressElement& element : result.elements) {
      const StressTally& tally = element.tallies[p];
      checks += tally.checks;
      html += fmt::format("<td{} title='{}'>{}</td>", tally.worst > 1 ? " class='fails'" : "",
                          escaped(fmt::format("{}: {}", tally.where, stress_command(element.element, tally.seed))),
                          ratio_text(tally));
    }
    html += fmt::format("<td>{}</td></tr>", checks);
  }
  html += "<tr><td>cases (without volume)</td>";
  for (const StressElement& element : result.elements)
    html += fmt::format("<td>{} ({})</td>", element.num_cases, element.num_refused);
  html += "<td></td></tr><tr><td>kriging's error over linear's, worst</td>";
  for (const StressElement& element : result.elements)
    html += fmt::format("<td>{}</td>", ratio_text(element.linear_ratio));
  html += "<td></td></tr><tr><td>h Σ|g| of damped rows, worst</td>";
  for (const StressElement& element : result.elements)
    html += fmt::format("<td>{}</td>", ratio_text(element.damped_norm));
  html += "<td></td></tr></table></div>";

  Chart chart{.title = "Worst error over bound",
              .x_label = "property",
              .y_label = "ratio",
              .log_x = false,
              .series = {},
              .guide_slopes = {}};
  int style = 0;
  for (const StressElement& element : result.elements) {
    ChartSeries series{.name = element.element, .x = {}, .y = {}, .notes = {}, .style = style++, .connected = false};
    for (std::size_t p = 0; p < num_stress_properties; ++p) {
      if (!(element.tallies[p].worst > 0)) continue;
      series.x.push_back(static_cast<double>(p) + 1);
      series.y.push_back(std::min(element.tallies[p].worst, 1e9));
      series.notes.push_back(
          fmt::format("{}, {}: {:.3g}", stress_properties()[p].name, element.element, element.tallies[p].worst));
    }
    chart.series.push_back(series);
  }
  html += svg_chart(chart);

  html += "<h2>Failures</h2>";
  if (result.failures.empty()) html += "<p>None.</p>";
  if (!result.failures.empty())
    html += "<table><tr><th>property</th><th>ratio</th><th>where</th><th>mesh</th><th>command</th></tr>";
  for (const StressFailure& failure : result.failures)
    html += fmt::format(
        "<tr><td>{} {}</td><td>{:.3g}</td><td class='text'>{}</td><td class='text'>{}</td><td "
        "class='text'><code>{}</code></td></tr>",
        failure.element, stress_properties()[static_cast<std::size_t>(failure.property)].name, failure.ratio,
        escaped(failure.where), escaped(failure.recipe), stress_command(failure.element, failure.seed));
  if (!result.failures.empty()) html += "</table>";
  html += "<h2>What is promised</h2><table>";
  for (const StressPropertyEntry& entry : stress_properties())
    html +=
        fmt::format("<tr><td>{}</td><td class='text'>{}</td></tr>", entry.name, escaped(std::string(entry.promise)));
  return html + "</table></body></html>\n";
}

}  // namespace

std::vector<std::string> write_stress_report(const StressResult& result, const std::filesystem::path& directory) {
  std::vector<std::string> files;
  std::filesystem::create_directories(directory);
  write_report(directory / "stress.json", stress_json(result), files);
  write_report(directory / "stress.html", stress_html(result), files);
  return files;
}

}  // namespace halfgrad
