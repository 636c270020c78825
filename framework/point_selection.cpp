#include "framework/point_selection.hpp"

#include <algorithm>

#include "framework/error.hpp"

namespace halfgrad {

Embedding select_points(const Embedding& embedding, std::span<const Index> points) {
  Embedding result;
  result.gdim = embedding.gdim;
  result.cells.resize(points.size());
  result.status.resize(points.size());
  result.local.resize(static_cast<Eigen::Index>(points.size()), embedding.local.cols());
  for (std::size_t i = 0; i < points.size(); ++i) {
    const Index p = points[i];
    if (p < 0 || p >= embedding.num_points())
      raise("point {} is chosen: expected 0 to {}", p, embedding.num_points() - 1);
    result.cells[i] = embedding.cells[p];
    result.status[i] = embedding.status[p];
    result.local.row(static_cast<Eigen::Index>(i)) = embedding.local.row(p);
    if (result.status[i] != PointStatus::outside && result.status[i] != PointStatus::not_found) continue;
    auto outside = *std::lower_bound(embedding.outside.begin(), embedding.outside.end(), p,
                                     [](const OutsidePoint& o, Index point) { return o.point < point; });
    outside.point = static_cast<Index>(i);
    result.outside.push_back(outside);
  }
  return result;
}

}  // namespace halfgrad
