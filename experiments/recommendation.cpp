#include "experiments/recommendation.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cassert>
#include <cmath>

namespace halfgrad {
namespace {

constexpr double decisive = 1.2;
constexpr Index fewest_points = 30;
// Linear errors below this fraction of an edge are round-off, of frames at rest or in rigid motion.
constexpr double round_off = 1e-9;

/// A rule and its gain over the frames.
struct Candidate {
  const ResultRow* row;
  double log_gain = 0;
  int frames = 0;
  double gain() const { return frames > 0 ? std::exp(log_gain / frames) : 1; }
};

bool same_rule(const ResultRow& a, const ResultRow& b) {
  return a.interpolant == b.interpolant && a.alpha == b.alpha && a.reconstructor == b.reconstructor &&
         a.options == b.options;
}

MeasuredRule measured(const Candidate& candidate) {
  return {candidate.row->interpolant, candidate.row->reconstructor, candidate.row->options, candidate.gain()};
}

}  // namespace

void pool_fold(std::vector<ResultRow>& rows, std::span<const ResultRow> fold) {
  assert(rows.size() == fold.size());
  for (std::size_t r = 0; r < rows.size(); ++r) {
    assert(rows[r].frame == fold[r].frame && same_rule(rows[r], fold[r]));
    rows[r].points += fold[r].points;
    for (int region = 0; region < 3; ++region) {
      RegionError& sum = rows[r].error[region];
      const RegionError& added = fold[r].error[region];
      const double squares = sum.points * sum.rms * sum.rms + added.points * added.rms * added.rms;
      const double total = sum.points * sum.mean + added.points * added.mean;
      sum.points += added.points;
      sum.max = std::max(sum.max, added.max);
      if (sum.points == 0) continue;
      sum.rms = std::sqrt(squares / sum.points);
      sum.mean = total / sum.points;
    }
  }
}

Recommendation recommend(std::span<const ResultRow> rows) {
  std::vector<Candidate> candidates;
  Recommendation result;
  constexpr int all = static_cast<int>(Region::all);
  for (const ResultRow& row : rows) {
    auto candidate = std::find_if(candidates.begin(), candidates.end(),
                                  [&](const Candidate& known) { return same_rule(*known.row, row); });
    if (candidate == candidates.end()) candidate = candidates.insert(candidates.end(), {&row});
    const std::optional<double>& gain = row.gain_over_linear[all];
    if (!gain || *gain * row.error[all].rms < round_off * row.h) continue;
    candidate->log_gain += std::log(*gain);
    ++candidate->frames;
    result.points = row.error[all].points;
    result.frames = std::max(result.frames, candidate->frames);
  }
  if (candidates.empty()) return result;
  const auto best = std::max_element(candidates.begin(), candidates.end(),
                                     [](const Candidate& a, const Candidate& b) { return a.gain() < b.gain(); });
  const auto safe = std::find_if(candidates.begin(), candidates.end(), [](const Candidate& candidate) {
    return candidate.row->interpolant == "phong" && candidate.row->reconstructor == "adaptive";
  });
  result.best = measured(*best);
  result.chosen = result.best;
  result.reason = "the best of all";
  if (safe == candidates.end()) return result;
  result.safe = measured(*safe);
  if (result.points < fewest_points) {
    result.chosen = *result.safe;
    result.reason = fmt::format("{} vertices could be held out, which say too little: the safe choice", result.points);
  } else if (best == safe) {
    result.reason = "the best of all, and the safe choice";
  } else if (!(result.best.gain >= decisive * result.safe->gain)) {
    result.chosen = *result.safe;
    result.reason = fmt::format("the safe choice; the best is less than {} times as accurate", decisive);
  }
  return result;
}

}  // namespace halfgrad
