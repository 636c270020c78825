// Results as one HTML file with script: charts, and a 3D view of two rules side by side.
#pragma once

#include <span>
#include <string>
#include <string_view>

namespace halfgrad {

/// The JSON texts of one run: results.json and scene.json (empty where there is none).
struct ReportedRun {
  std::string results, scene;
};

/// The page's script and style, bundled from experiments/report_web; empty in builds without npm.
std::string_view report_script();

/// A self-contained page that opens offline: the script, and the runs as data. Needs a report_script().
std::string interactive_html(const std::string& title, std::span<const ReportedRun> runs);

}  // namespace halfgrad
