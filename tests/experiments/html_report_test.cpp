#include "experiments/html_report.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <pugixml.hpp>

#include <cmath>

#include "experiments/svg_chart.hpp"

namespace halfgrad {
namespace {

using testing::AllOf;
using testing::HasSubstr;
using testing::Not;

// Two levels of two rules with known errors.
ExperimentResult small_result() {
  ExperimentResult result;
  result.name = "a <b> & c";
  result.config = R"({"description": "x < y"})";
  result.machine = R"({"processor": "p"})";
  for (int level = 0; level < 2; ++level)
    for (const char* reconstructor : {"", "kriging"}) {
      ResultRow row;
      row.level = level;
      row.h = level == 0 ? 0.2 : 0.1;
      row.interpolant = *reconstructor == 0 ? "linear" : "phong";
      row.reconstructor = reconstructor;
      row.evaluate_seconds = *reconstructor == 0 ? 1e-3 : 2e-3;
      for (RegionError& error : row.error)
        error = {
            .max = 2 * row.h * row.h, .rms = *reconstructor == 0 ? row.h * row.h : row.h * row.h * row.h, .points = 9};
      result.rows.push_back(row);
    }
  result.orders = orders_of(result.rows);
  return result;
}

std::size_t count(const std::string& text, const std::string& word) {
  std::size_t found = 0;
  for (std::size_t at = text.find(word); at != std::string::npos; at = text.find(word, at + 1)) ++found;
  return found;
}

TEST(HtmlReport, IsWellFormedAndNeedsNothingElse) {
  const ExperimentResult result = small_result();
  const std::string html = results_html(result.name, {&result, 1});
  EXPECT_THAT(html, AllOf(HasSubstr("a &lt;b&gt; &amp; c"), HasSubstr("x &lt; y"), Not(HasSubstr("<script")),
                          Not(HasSubstr("src=")), Not(HasSubstr("href="))));
  // Every chart is XML by itself.
  std::size_t charts = 0;
  for (std::size_t at = html.find("<svg viewBox"); at != std::string::npos; at = html.find("<svg viewBox", at + 1)) {
    pugi::xml_document document;
    const std::string svg = html.substr(at, html.find("</svg>", at) + 6 - at);
    EXPECT_TRUE(document.load_string(svg.c_str())) << svg;
    ++charts;
  }
  EXPECT_EQ(charts, 3u);  // inside, boundary, run time
}

TEST(HtmlReport, MarksTheBestOfEachColumn) {
  const ExperimentResult result = small_result();
  const std::string html = results_html(result.name, {&result, 1});
  const std::string table = html.substr(html.find("<table>"), html.find("</table>") - html.find("<table>"));
  const std::string phong = table.substr(table.find("phong"));
  EXPECT_THAT(phong, HasSubstr("<td class='best'>1.000e-03</td>"));
  EXPECT_THAT(phong, HasSubstr("<td class='best'>3.00</td>"));
  EXPECT_THAT(table.substr(0, table.find("phong")), AllOf(HasSubstr("<td class='best'>1</td>"), HasSubstr("2.00")));
}

TEST(SvgChart, PlacesPointsOnTheirAxes) {
  Chart chart;
  chart.series = {{.name = "s", .x = {1, 10, 100}, .y = {1, 100, 10000}, .notes = {}}};
  pugi::xml_document document;
  ASSERT_TRUE(document.load_string(svg_chart(chart).c_str()));
  std::vector<double> x, y;
  for (const auto& circle : document.select_nodes("//circle")) {
    x.push_back(circle.node().attribute("cx").as_double());
    y.push_back(circle.node().attribute("cy").as_double());
  }
  ASSERT_EQ(x.size(), 3u);
  // Equal factors are equal steps, to the tenth of a pixel that is written; y grows upwards.
  EXPECT_NEAR(x[1] - x[0], x[2] - x[1], 0.11);
  EXPECT_NEAR(y[1] - y[0], y[2] - y[1], 0.11);
  EXPECT_GT(y[0], y[2]);
}

TEST(SvgChart, LeavesOutWhatAnAxisCannotShow) {
  Chart chart;
  const double infinity = std::numeric_limits<double>::infinity();
  chart.series = {{.name = "s", .x = {0, 1, 2, 3, 4}, .y = {1, -1, std::nan(""), infinity, 1}, .notes = {}}};
  EXPECT_EQ(count(svg_chart(chart), "<circle"), 1u);
  chart.series[0].y.assign(5, 0);
  EXPECT_EQ(count(svg_chart(chart), "<circle"), 0u);
  EXPECT_THAT(svg_chart(chart), Not(HasSubstr("nan")));
}

}  // namespace
}  // namespace halfgrad
