#include "experiments/html_report.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <functional>
#include <limits>
#include <map>
#include <nlohmann/json.hpp>

#include "experiments/svg_chart.hpp"
#include "framework/version.hpp"

namespace halfgrad {

namespace {

constexpr const char* style_sheet = R"(
body { font: 15px/1.5 system-ui, sans-serif; color: #1a1a1a; background: #fff; max-width: 1180px; margin: 2em auto; padding: 0 1em; }
h1 { font-size: 1.6em; margin-bottom: 0; } h2 { font-size: 1.15em; margin-top: 2em; }
p.facts { color: #555; margin-top: .3em; }
table { border-collapse: collapse; font-variant-numeric: tabular-nums; }
th, td { padding: .25em .7em; text-align: right; border-bottom: 1px solid #ddd; white-space: nowrap; }
th { border-bottom: 2px solid #888; font-weight: 600; } th:first-child, td:first-child { text-align: left; }
td.best { font-weight: 700; background: #e3f1e9; }
td svg { vertical-align: -2px; margin-right: .4em; }
.charts { display: grid; grid-template-columns: repeat(auto-fit, minmax(400px, 1fr)); gap: 1em; }
.charts svg { width: 100%; height: auto; font: 12px system-ui, sans-serif; }
.charts .title { font-weight: 600; font-size: 13px; }
.grid { stroke: #e4e4e4; } .frame { fill: none; stroke: #888; } .guide { stroke: #888; stroke-dasharray: 2 3; fill: none; }
text.guide { stroke: none; fill: #666; }
.holds { color: #00714f; } .fails { color: #b32d00; font-weight: 700; }
.scroll { overflow-x: auto; } pre { background: #f5f5f5; padding: 1em; overflow-x: auto; }
)";

std::string name_of(const ResultRow& row) { return rule_name(row.interpolant, row.reconstructor, row.options); }

// Number of a rule's colour and marker, the same in table and charts.
class Styles {
 public:
  explicit Styles(const ExperimentResult& result) {
    for (const ResultRow& row : result.rows) numbers_.emplace(name_of(row), static_cast<int>(numbers_.size()));
  }
  int operator[](const std::string& name) const { return numbers_.at(name); }

 private:
  std::map<std::string, int> numbers_;
};

// No value: shown as a dash, left out of charts.
constexpr double missing = std::numeric_limits<double>::quiet_NaN();

double frame_seconds(const ResultRow& row) { return row.gradients_seconds + row.evaluate_seconds; }

// A column of the table; the best is the least or the greatest.
struct Column {
  std::string title;
  std::function<double(const ResultRow&)> value;  // NaN shows as a dash
  std::string format;
  enum { least, greatest, none } best;
};

std::string table(const ExperimentResult& result, const std::vector<const ResultRow*>& rows, const Styles& styles) {
  const auto error = [](Region region, Norm norm) {
    return [=](const ResultRow& row) {
      const RegionError& entry = row.error[static_cast<std::size_t>(region)];
      return entry.points > 0 ? entry[norm] : missing;
    };
  };
  const auto gain = [](Region region) {
    return
        [=](const ResultRow& row) { return row.gain_over_linear[static_cast<std::size_t>(region)].value_or(missing); };
  };
  const auto slope = [&result](Region region) {
    return [&result, region](const ResultRow& row) {
      for (const ResultOrder& order : result.orders)
        if (order.interpolant == row.interpolant && order.reconstructor == row.reconstructor &&
            order.options == row.options && order.region == region && order.norm == Norm::rms)
          return order.slope;
      return missing;
    };
  };
  std::vector<Column> columns = {{"rms inside", error(Region::interior, Norm::rms), "{:.3e}", Column::least},
                                 {"max inside", error(Region::interior, Norm::max), "{:.3e}", Column::least},
                                 {"gain inside", gain(Region::interior), "{:.3g}", Column::greatest},
                                 {"rms at boundary", error(Region::boundary, Norm::rms), "{:.3e}", Column::least},
                                 {"max at boundary", error(Region::boundary, Norm::max), "{:.3e}", Column::least},
                                 {"gain at boundary", gain(Region::boundary), "{:.3g}", Column::greatest}};
  if (!result.orders.empty()) {
    columns.push_back({"order inside", slope(Region::interior), "{:.2f}", Column::greatest});
    columns.push_back({"order at boundary", slope(Region::boundary), "{:.2f}", Column::greatest});
  }
  columns.push_back(
      {"ms a frame", [](const ResultRow& row) { return 1e3 * frame_seconds(row); }, "{:.3g}", Column::least});

  std::string html = "<div class='scroll'><table><tr><th>rule</th>";
  for (const Column& column : columns) html += fmt::format("<th>{}</th>", column.title);
  html += "</tr>";
  for (const ResultRow* row : rows) {
    html += fmt::format("<tr><td>{}{}</td>", svg_marker(styles[name_of(*row)]), escaped(name_of(*row)));
    for (const Column& column : columns) {
      const double value = column.value(*row);
      // Exact gradients are a bound, not a choice: they do not compete.
      bool best = column.best != Column::none && row->reconstructor != "exact" && value == value;
      for (const ResultRow* other : rows)
        if (other->reconstructor != "exact")
          best = best && !(column.best == Column::least ? column.value(*other) < value : column.value(*other) > value);
      html += fmt::format("<td{}>{}</td>", best ? " class='best'" : "",
                          value == value ? fmt::format(fmt::runtime(column.format), value) : "–");
    }
    html += "</tr>";
  }
  return html + "</table></div>";
}

// A chart with one line a rule through the rows of `rows` that have it.
Chart by_rule(const std::vector<const ResultRow*>& rows, const Styles& styles,
              const std::function<double(const ResultRow&)>& x, const std::function<double(const ResultRow&)>& y) {
  Chart chart;
  std::map<std::string, std::size_t> series_of;
  for (const ResultRow* row : rows) {
    const std::string name = name_of(*row);
    const auto [entry, is_new] = series_of.emplace(name, chart.series.size());
    if (is_new) chart.series.push_back({.name = name, .x = {}, .y = {}, .notes = {}, .style = styles[name]});
    ChartSeries& series = chart.series[entry->second];
    series.x.push_back(x(*row));
    series.y.push_back(y(*row));
    series.notes.push_back(fmt::format("{}: {:.3g}, {:.3e}", name, series.x.back(), series.y.back()));
  }
  return chart;
}

double rms(const ResultRow& row, Region region) {
  const RegionError& error = row.error[static_cast<std::size_t>(region)];
  return error.points > 0 ? error.rms : missing;
}

std::string convergence_charts(const std::vector<const ResultRow*>& rows, const Styles& styles) {
  std::string html;
  for (const Region region : {Region::interior, Region::boundary}) {
    Chart chart = by_rule(
        rows, styles, [](const ResultRow& row) { return row.h; },
        [region](const ResultRow& row) { return rms(row, region); });
    chart.title = region == Region::interior ? "Convergence inside" : "Convergence at the boundary";
    chart.x_label = "mean edge length h";
    chart.y_label = "rms error";
    chart.guide_slopes = {2, 3};
    html += svg_chart(chart);
  }
  return html;
}

// Run time against error, with the front of rules that nothing beats in both.
std::string pareto_chart(const std::vector<const ResultRow*>& rows, const Styles& styles) {
  Chart chart = by_rule(
      rows, styles, [](const ResultRow& row) { return 1e3 * frame_seconds(row); },
      [](const ResultRow& row) { return rms(row, Region::all); });
  for (ChartSeries& series : chart.series) series.connected = false;
  chart.title = "Run time against error (line: nothing is better in both)";
  chart.x_label = "ms a frame (gradients and points)";
  chart.y_label = "rms error";
  std::vector<std::pair<double, double>> front;
  for (const ResultRow* row : rows)
    if (row->reconstructor != "exact") front.emplace_back(1e3 * frame_seconds(*row), rms(*row, Region::all));
  std::sort(front.begin(), front.end());
  constexpr int black = 6;
  ChartSeries line{.name = "Pareto front", .x = {}, .y = {}, .notes = {}, .style = black, .has_markers = false};
  double least = std::numeric_limits<double>::infinity();
  for (const auto& [seconds, error] : front)
    if (error < least) {
      least = error;
      line.x.push_back(seconds);
      line.y.push_back(error);
    }
  chart.series.insert(chart.series.begin(), line);
  return svg_chart(chart);
}

std::string frame_chart(const std::vector<const ResultRow*>& rows, const Styles& styles) {
  Chart chart = by_rule(
      rows, styles, [](const ResultRow& row) { return row.frame; },
      [](const ResultRow& row) { return rms(row, Region::all); });
  chart.title = "Error a frame, finest level";
  chart.x_label = "frame";
  chart.y_label = "rms error";
  chart.log_x = false;
  return svg_chart(chart);
}

std::string expectation_list(const ExperimentResult& result) {
  std::string html = "<h2>Expectations</h2><ul>";
  for (const ResultExpectation& expected : result.expectations)
    html += fmt::format("<li><span class='{}'>{}</span> <code>{}</code>: measured {:.4g}</li>",
                        expected.holds ? "holds" : "fails", expected.holds ? "holds" : "does not hold",
                        escaped(expected.text), expected.measured);
  return html + "</ul>";
}

std::string result_section(const ExperimentResult& result) {
  const Styles styles(result);
  const ResultRow last = result.rows.empty() ? ResultRow() : result.rows.back();
  std::vector<const ResultRow*> finest, last_frame, last_level;
  for (const ResultRow& row : result.rows) {
    if (row.frame == last.frame) last_frame.push_back(&row);
    if (row.level == last.level) last_level.push_back(&row);
    if (row.frame == last.frame && row.level == last.level) finest.push_back(&row);
  }
  const nlohmann::json config = nlohmann::json::parse(result.config), machine = nlohmann::json::parse(result.machine);

  std::string html = fmt::format("<h1>{}</h1>", escaped(result.name));
  if (config.contains("description"))
    html += fmt::format("<p>{}</p>", escaped(config["description"].get<std::string>()));
  html +=
      fmt::format("<p class='facts'>{} vertices, {} cells ({}), h {:.4g}, {} points; frame {}; halfgrad {} on {}</p>",
                  last.vertices, last.cells, escaped(last.element), last.h, last.points, last.frame, version,
                  escaped(machine.value("processor", "unknown")));
  html +=
      "<h2>The finest level</h2><p>The best of each column is marked; <em>gain</em> is the rms error of linear "
      "interpolation over the rule's; <em>exact</em> takes the field's own gradients and only shows the bound.</p>";
  html += table(result, finest, styles);
  html += "<h2>Charts</h2><div class='charts'>";
  if (last_frame.size() > finest.size()) html += convergence_charts(last_frame, styles);
  html += pareto_chart(last_frame, styles);
  if (last_level.size() > finest.size()) html += frame_chart(last_level, styles);
  html += "</div>";
  if (!result.expectations.empty()) html += expectation_list(result);
  html += fmt::format("<h2>Configuration</h2><details><summary>with all defaults</summary><pre>{}</pre></details>",
                      escaped(config.dump(2)));
  return html;
}

}  // namespace

std::string results_html(const std::string& title, std::span<const ExperimentResult> results) {
  std::string html = fmt::format(
      "<!DOCTYPE html>\n<html lang='en'><head><meta charset='utf-8'><meta name='viewport' "
      "content='width=device-width'><title>{}</title><style>{}</style></head><body>",
      escaped(title), style_sheet);
  for (const ExperimentResult& result : results) html += result_section(result);
  html +=
      "<p class='facts'>Charts without script: this halfgrad was built without npm. With npm, the page is interactive "
      "and shows the points in 3D.</p>";
  return html + "</body></html>\n";
}

}  // namespace halfgrad
