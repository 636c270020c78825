// Which rule to take, from what was measured on vertices held out.
#pragma once

#include <span>
#include <vector>

#include "experiments/results.hpp"

namespace halfgrad {

/// Adds the rows of a further fold to `rows`: the same levels, frames and rules in the same order. Errors are pooled
/// over the points of all folds; gains must be taken anew. Seconds and counts of cells and vertices stay the first
/// fold's.
void pool_fold(std::vector<ResultRow>& rows, std::span<const ResultRow> fold);

/// The rule with the greatest gain over linear, geometric mean over the frames; `phong` with `adaptive` where that is
/// among the rules and the best is not decisively better (1.2 times), or where fewer than thirty points were measured.
/// Frames that linear carries to round-off do not count. The factor and its price: docs/choosing.md.
Recommendation recommend(std::span<const ResultRow> rows);

}  // namespace halfgrad
