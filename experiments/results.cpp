#include "experiments/results.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>
#include <tuple>

namespace halfgrad {

bool ExperimentResult::all_expectations_hold() const {
  return std::all_of(expectations.begin(), expectations.end(), [](const auto& expected) { return expected.holds; });
}

std::array<RegionError, 3> region_errors(const Points& measured, const Points& truth,
                                         std::span<const PointPlace> places) {
  std::array<RegionError, 3> errors;
  std::array<double, 3> squares{}, sums{};
  for (Eigen::Index p = 0; p < measured.rows(); ++p) {
    if (places[p] == PointPlace::nowhere) continue;
    const double error = (measured.row(p) - truth.row(p)).norm();
    const Region own = places[p] == PointPlace::boundary ? Region::boundary : Region::interior;
    for (Region region : {Region::all, own}) {
      RegionError& norms = errors[static_cast<int>(region)];
      if (!(error <= norms.max)) norms.max = error;  // NaN stays visible
      squares[static_cast<int>(region)] += error * error;
      sums[static_cast<int>(region)] += error;
      ++norms.points;
    }
  }
  for (int r = 0; r < 3; ++r)
    if (errors[r].points > 0) {
      errors[r].rms = std::sqrt(squares[r] / errors[r].points);
      errors[r].mean = sums[r] / errors[r].points;
    }
  return errors;
}

std::optional<double> fitted_order(std::span<const double> h, std::span<const double> errors) {
  double sum_x = 0, sum_y = 0, sum_xx = 0, sum_xy = 0;
  int count = 0;
  for (std::size_t i = 0; i < h.size(); ++i) {
    if (!(h[i] > 0 && errors[i] > 0)) continue;
    const double x = std::log(h[i]), y = std::log(errors[i]);
    sum_x += x;
    sum_y += y;
    sum_xx += x * x;
    sum_xy += x * y;
    ++count;
  }
  const double spread = sum_xx - sum_x * sum_x / std::max(count, 1);
  if (count < 2 || !(spread > 1e-12)) return std::nullopt;
  return (sum_xy - sum_x * sum_y / count) / spread;
}

std::vector<ResultOrder> orders_of(const std::vector<ResultRow>& rows) {
  const auto key = [](const ResultRow& row) {
    return std::tie(row.interpolant, row.alpha, row.reconstructor, row.options);
  };
  int last_frame = 0;
  for (const ResultRow& row : rows) last_frame = std::max(last_frame, row.frame);
  std::vector<ResultOrder> orders;
  std::vector<char> done(rows.size(), 0);
  for (std::size_t first = 0; first < rows.size(); ++first) {
    if (done[first] || rows[first].frame != last_frame) continue;
    std::vector<const ResultRow*> levels;
    for (std::size_t other = first; other < rows.size(); ++other)
      if (rows[other].frame == last_frame && key(rows[other]) == key(rows[first])) {
        done[other] = 1;
        levels.push_back(&rows[other]);
      }
    for (Region region : {Region::all, Region::interior, Region::boundary}) {
      for (Norm norm : {Norm::rms, Norm::max}) {
        std::vector<double> h, errors;
        for (const ResultRow* row : levels) {
          h.push_back(row->h);
          errors.push_back(row->error[static_cast<int>(region)][norm]);
        }
        if (const auto slope = fitted_order(h, errors))
          orders.push_back(
              {rows[first].interpolant, rows[first].reconstructor, rows[first].options, region, norm, *slope});
      }
    }
  }
  return orders;
}

std::string rule_name(const std::string& interpolant, const std::string& reconstructor, const std::string& options) {
  std::string name = reconstructor.empty() ? interpolant : interpolant + " + " + reconstructor;
  const nlohmann::json object = nlohmann::json::parse(options.empty() ? "{}" : options);
  std::string details;
  for (const auto& [key, value] : object.items())
    details += fmt::format("{}{} {}", details.empty() ? "" : ", ", key,
                           value.is_string() ? value.get<std::string>() : value.dump());
  return details.empty() ? name : name + " (" + details + ")";
}

}  // namespace halfgrad
