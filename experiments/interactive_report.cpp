#include "experiments/interactive_report.hpp"

#include <fmt/format.h>

#include <cassert>

#include "experiments/svg_chart.hpp"

namespace halfgrad {

namespace {

/// JSON that no HTML parser takes for the end of the script it stands in; "<\/" is "</" to a JSON parser.
std::string without_end_tags(std::string json) {
  for (std::size_t at = json.find("</"); at != std::string::npos; at = json.find("</", at)) json.replace(at, 2, "<\\/");
  return json;
}

}  // namespace

std::string interactive_html(const std::string& title, std::span<const ReportedRun> runs) {
  assert(!report_script().empty());
  std::string data;
  for (const ReportedRun& run : runs)
    data += fmt::format("{}{{\"results\":{},\"scene\":{}}}", data.empty() ? "" : ",", without_end_tags(run.results),
                        run.scene.empty() ? "null" : without_end_tags(run.scene));
  return fmt::format(
      "<!DOCTYPE html>\n<html lang='en'><head><meta charset='utf-8'><meta name='viewport' "
      "content='width=device-width,initial-scale=1'><title>{0}</title></head><body>"
      "<noscript>This page needs JavaScript; results.json beside it has the numbers.</noscript>\n"
      "<script type='application/json' id='halfgrad-data'>{{\"title\":\"{0}\",\"runs\":[{1}]}}</script>\n"
      "<script>{2}</script></body></html>\n",
      escaped(title), data, report_script());
}

}  // namespace halfgrad
