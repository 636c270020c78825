#include <algorithm>
#include <cmath>

#include "experiments/experiment.hpp"
#include "framework/error.hpp"

namespace halfgrad {
namespace {

std::string gain_text(const std::optional<double>& gain) { return gain ? fmt::format("{:.3g}", *gain) : "-"; }

std::string gain_of(const MeasuredRule& rule) {
  return fmt::format("{} {:.3g}", rule_name(rule.interpolant, rule.reconstructor, rule.options), rule.gain);
}

std::string recommendation_text(const Recommendation& recommendation) {
  const MeasuredRule& chosen = recommendation.chosen;
  std::string text =
      fmt::format("recommended: {} ({})\n  gains over linear on {} vertices held out, {} frames: best {}",
                  rule_name(chosen.interpolant, chosen.reconstructor, chosen.options), recommendation.reason,
                  recommendation.points, recommendation.frames, gain_of(recommendation.best));
  if (recommendation.safe) text += fmt::format(", safe {}", gain_of(*recommendation.safe));
  text += fmt::format("\n  halfgrad deform --interpolant {}", chosen.interpolant);
  if (!chosen.reconstructor.empty())
    text +=
        fmt::format(" --reconstructor '{}'", chosen.options == "{}" || chosen.options.empty()
                                                 ? chosen.reconstructor
                                                 : fmt::format("{{\"{}\":{}}}", chosen.reconstructor, chosen.options));
  return text + " ...\n";
}

// How many times the cells linear interpolation would need for the error of a row of the last level: from the slope of
// its error, and from how the cells of the levels grow as h falls. None where the levels do not tell.
std::optional<double> cells_linear_needs(const ExperimentResult& result, const ResultRow& row) {
  const std::optional<double>& gain = row.gain_over_linear[static_cast<std::size_t>(Region::all)];
  const auto linear = std::find_if(result.orders.begin(), result.orders.end(), [](const ResultOrder& entry) {
    return entry.interpolant == "linear" && entry.region == Region::all && entry.norm == Norm::rms;
  });
  const ResultRow& first = result.rows.front();
  if (!gain || linear == result.orders.end() || !(linear->slope > 0) || first.cells >= row.cells || first.h <= row.h)
    return std::nullopt;
  const double growth = std::log(static_cast<double>(row.cells) / first.cells) / std::log(first.h / row.h);
  return std::pow(*gain, growth / linear->slope);
}

}  // namespace

std::string summary_table(const ExperimentResult& result) {
  if (result.rows.empty()) return {};
  const ResultRow& last = result.rows.back();
  std::string text = fmt::format("{}: {} vertices, {} cells ({}), h {:.4g}, {} points", result.name, last.vertices,
                                 last.cells, last.element, last.h, last.points);
  if (last.frame > 0) text += fmt::format(", frame {}", last.frame);
  text += '\n';

  // The last level and frame, a line a rule; slopes beside the errors where there are several levels.
  std::size_t width = 12;
  for (const ResultRow& row : result.rows)
    width = std::max(width, rule_name(row.interpolant, row.reconstructor, row.options).size());
  text += fmt::format("  {:<{}}  {:>10} {:>10}  {:>9} {:>9}", "rule", width, "rms inside", "boundary", "gain in.",
                      "gain bnd.");
  if (!result.orders.empty()) text += fmt::format("  {:>9} {:>9}", "order in.", "order bnd.");
  const bool has_cells = std::any_of(result.rows.begin(), result.rows.end(), [&](const ResultRow& row) {
    return row.level == last.level && cells_linear_needs(result, row);
  });
  text += fmt::format("  {:>8}{}\n", "time", has_cells ? "  linear needs" : "");
  for (const ResultRow& row : result.rows) {
    if (row.level != last.level || row.frame != last.frame) continue;
    const auto rms = [&](Region region) {
      const RegionError& error = row.error[static_cast<int>(region)];
      return error.points > 0 ? fmt::format("{:.3e}", error.rms) : std::string("-");
    };
    text += fmt::format("  {:<{}}  {:>10} {:>10}  {:>9} {:>9}",
                        rule_name(row.interpolant, row.reconstructor, row.options), width, rms(Region::interior),
                        rms(Region::boundary), gain_text(row.gain_over_linear[1]), gain_text(row.gain_over_linear[2]));
    if (!result.orders.empty()) {
      for (const Region region : {Region::interior, Region::boundary}) {
        const auto order = std::find_if(result.orders.begin(), result.orders.end(), [&](const ResultOrder& entry) {
          return entry.interpolant == row.interpolant && entry.reconstructor == row.reconstructor &&
                 entry.options == row.options && entry.region == region && entry.norm == Norm::rms;
        });
        text += order == result.orders.end() ? fmt::format(" {:>9}", "-") : fmt::format(" {:>9.2f}", order->slope);
      }
    }
    text += fmt::format("  {:>8}", row.time_over_linear ? fmt::format("{:.3g}x", *row.time_over_linear) : "-");
    if (const auto cells = cells_linear_needs(result, row); cells) text += fmt::format("  {:>6.3g}x cells", *cells);
    text += '\n';
  }
  if (result.recommendation) text += recommendation_text(*result.recommendation);
  const auto held = std::count_if(result.expectations.begin(), result.expectations.end(),
                                  [](const ResultExpectation& expected) { return expected.holds; });
  if (!result.expectations.empty()) text += fmt::format("expect: {} of {} hold\n", held, result.expectations.size());
  for (const ResultExpectation& expected : result.expectations)
    if (!expected.holds)
      text += fmt::format("  does not hold: {}: {} {:.4g}, measured {:.4g}\n", expected.text, expected.bound,
                          expected.limit, expected.measured);
  return text;
}

}  // namespace halfgrad
