// The points are sorted into boxes and the cells stream past them, so that no index of the cells is built:
//
//   boxes of one slab, the last axis fastest  x[0]: | box 0 | box 1 | box 2 | …      one array a coordinate,
//   first[box] … first[box + 1] are its       x[1]: | box 0 | box 1 | box 2 | …      and beside them per point the
//   points in the sorted arrays               x[2]: | box 0 | box 1 | box 2 | …      best margin and its cell
//
// The boxes that a cell's bounds meet along the last axis are one contiguous range of points: a row. A cell tests rows.
// ξ waits in this order too: written at the caller's places while cells are tested, it would miss the cache each time.
//
// A slab has a range of the boxes along the first axis. One suffices for eight points a cell, or a million; more points
// are cut into more, so that neither the working set nor the memory beside the result grows with their number, and
// threads take slabs. In R³ a slab takes 64 bytes a point (16 less a dimension less), at most 8 more for the boxes, and
// where there are several 4 bytes for each of the points and for each cell and slab that it meets.
#include "framework/cell_locator.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numeric>
#include <optional>
#include <span>

#include "framework/inverse_map.hpp"
#include "framework/large_array.hpp"
#include "framework/parallel.hpp"
#include "framework/plane_margins.hpp"

namespace halfgrad {

namespace {

constexpr double infinity = std::numeric_limits<double>::infinity();

template <int D>
using Coordinates = Eigen::Matrix<double, D, 1>;

template <int D>
struct Bounds {
  Coordinates<D> low = Coordinates<D>::Constant(infinity), high = Coordinates<D>::Constant(-infinity);
  bool contains(const Coordinates<D>& x) const {
    bool inside = true;
    for (int a = 0; a < D; ++a) inside &= x[a] >= low[a] && x[a] <= high[a];
    return inside;
  }
  bool meets(const Bounds& other) const {
    bool met = true;
    for (int a = 0; a < D; ++a) met &= other.low[a] <= high[a] && other.high[a] >= low[a];
    return met;
  }
  void include(const Coordinates<D>& x) {
    for (int a = 0; a < D; ++a) {
      low[a] = std::min(low[a], x[a]);
      high[a] = std::max(high[a], x[a]);
    }
  }
};

// What a cell can hold: its nodes' bounds, grown by what the tolerance lets weights be negative.
template <Element E>
Bounds<E::dim> cell_bounds(const Mesh& mesh, const ElementBlock<E>& block, Eigen::Index row, double tolerance) {
  const double* vertices = mesh.vertices().data();
  const Index* nodes = block.cells.data() + row * E::num_nodes;
  Bounds<E::dim> bounds;
  for (int a = 0; a < E::dim; ++a) {
    double low = infinity, high = -infinity;
    for (int i = 0; i < E::num_nodes; ++i) {
      const double x = vertices[static_cast<Offset>(nodes[i]) * E::dim + a];
      low = std::min(low, x);
      high = std::max(high, x);
    }
    const double growth = E::num_nodes * tolerance * (high - low);
    bounds.low[a] = low - growth;
    bounds.high[a] = high + growth;
  }
  return bounds;
}

// Calls f(ElementBlock<E>, first cell) for the blocks whose elements have dimension D: all of them, in a mesh of R^D.
template <int D, class Function>
void for_each_block_of_dim(const Mesh& mesh, Function&& f) {
  for_each_block(mesh, [&]<Element E>(const ElementBlock<E>& block, Index first) {
    if constexpr (E::dim == D) f(block, first);
  });
}

// What the cells say about the grid that suits them.
template <int D>
struct CellStatistics {
  Bounds<D> bounds;
  Coordinates<D> mean_extent = Coordinates<D>::Zero();
};

template <int D>
CellStatistics<D> cell_statistics(const Mesh& mesh, double tolerance) {
  CellStatistics<D> result;
  Index num_sampled = 0;
  for_each_block_of_dim<D>(mesh, [&]<Element E>(const ElementBlock<E>& block, Index) {
    // Every cell could set the bounds of the mesh, but a few thousand tell the mean extent.
    const Eigen::Index stride = std::max<Eigen::Index>(1, block.cells.rows() / 4096);
    for (Eigen::Index c = 0; c < block.cells.rows(); c += stride) {
      const auto positions = node_positions(mesh, block, c);
      result.mean_extent += cell_extent<E>(positions);
      ++num_sampled;
    }
  });
  if (num_sampled > 0) result.mean_extent /= num_sampled;
  const auto vertices = mesh.vertices().template leftCols<D>();
  for (Index v = 0; v < mesh.num_vertices(); ++v) result.bounds.include(vertices.row(v).transpose());
  const double growth = 1e-9 + max_nodes * tolerance;
  const Coordinates<D> extent = result.bounds.high - result.bounds.low;
  result.bounds.low -= growth * extent;
  result.bounds.high += growth * extent;
  return result;
}

// The boxes: a regular lattice over the points. A slice is a layer of them along axis 0.
template <int D>
class Boxes {
 public:
  // For points of these bounds.
  Boxes(const Bounds<D>& bounds, Index num_points, const CellStatistics<D>& cells, Index num_cells);

  int size(int axis) const { return size_[axis]; }
  std::int64_t boxes_a_slice() const {
    std::int64_t number = 1;
    for (int a = 1; a < D; ++a) number *= size_[a];
    return number;
  }
  // The box along an axis that holds a coordinate; monotone, so that no rounding separates a point from its cell.
  int box(int axis, double coordinate) const {
    const double scaled = (coordinate - bounds_.low[axis]) * per_length_[axis];
    return static_cast<int>(std::min(std::max(scaled, 0.0), size_[axis] - 1.0));
  }
  bool meets(const Bounds<D>& cell_bounds) const { return bounds_.meets(cell_bounds); }
  bool contains(const Coordinates<D>& position) const { return bounds_.contains(position); }

 private:
  Bounds<D> bounds_;  // of the points
  Coordinates<D> per_length_;
  std::array<int, D> size_{};
};

template <int D>
Boxes<D>::Boxes(const Bounds<D>& bounds, Index num_points, const CellStatistics<D>& cells, Index num_cells)
    : bounds_(bounds) {
  // Boxes in proportion to the cells' extents, so that a stretched mesh looks as an isotropic one; about one box for
  // two cells, and no more than two a point.
  const Coordinates<D> extent = num_points > 0 ? Coordinates<D>(bounds_.high - bounds_.low) : Coordinates<D>::Zero();
  const double target = std::max(1.0, std::min(0.5 * num_cells, 2.0 * num_points));
  Coordinates<D> in_cells;
  for (int a = 0; a < D; ++a)
    in_cells[a] = extent[a] > 0 ? extent[a] / std::max(cells.mean_extent[a], 1e-9 * extent[a]) : 0;
  // An axis shorter than a box gets one; the others share the target.
  std::array<bool, D> flat{};
  double factor = 1;
  for (int pass = 0; pass <= D; ++pass) {
    double product = 1;
    int num_axes = 0;
    for (int a = 0; a < D; ++a)
      if (!flat[a] && in_cells[a] > 0) product *= in_cells[a], ++num_axes;
    if (num_axes == 0) break;
    factor = std::pow(target / product, 1.0 / num_axes);
    bool changed = false;
    for (int a = 0; a < D; ++a)
      if (!flat[a] && in_cells[a] * factor < 1) flat[a] = changed = true;
    if (!changed) break;
  }
  for (int a = 0; a < D; ++a) {
    size_[a] = flat[a] || in_cells[a] == 0 ? 1 : static_cast<int>(std::max(1.0, std::floor(in_cells[a] * factor)));
    per_length_[a] = extent[a] > 0 ? size_[a] / extent[a] : 0;
    if (!std::isfinite(per_length_[a])) per_length_[a] = 0;
  }
}

// A contiguous range of slices, its points by the caller's numbers, ascending, and the cells of each block that meet
// it, ascending, as rows of the block. Where one slab has all, nothing is listed.
struct Slab {
  int first_slice, last_slice;
  const Index* points = nullptr;
  Index num_points = 0;
  std::vector<std::vector<Index>> rows;

  bool is_whole() const { return points == nullptr; }
};

// The points of a slab, sorted by boxes.
template <int D>
class SlabPoints {
 public:
  SlabPoints(const Points& points, const Boxes<D>& boxes, const Slab& slab);

  bool meets(const Bounds<D>& cell_bounds) const { return boxes_.meets(cell_bounds); }

  Coordinates<D> position(Index point) const {
    Coordinates<D> result;
    for (int a = 0; a < D; ++a) result[a] = x[a][point];
    return result;
  }

  // Calls f(begin, end) for each row of points that the bounds meet.
  template <class Function>
  void for_each_row(const Bounds<D>& range, Function&& f) const {
    std::array<int, D> low, high, at;
    for (int a = 0; a < D; ++a) {
      low[a] = boxes_.box(a, range.low[a]);
      high[a] = boxes_.box(a, range.high[a]);
    }
    low[0] = std::max(low[0] - slab_.first_slice, 0);
    high[0] = std::min(high[0], slab_.last_slice) - slab_.first_slice;
    if (low[0] > high[0]) return;
    at = low;
    while (true) {
      std::int64_t row = 0;
      for (int a = 0; a < D - 1; ++a) row = (row + at[a]) * boxes_.size(a + 1);
      // In one dimension the slices are the row's own axis.
      const Index begin = first_[row + low[D - 1]], end = first_[row + high[D - 1] + 1];
      if (begin < end) f(begin, end);
      int a = D - 2;
      while (a >= 0 && at[a] == high[a]) at[a] = low[a], --a;
      if (a < 0) return;
      ++at[a];
    }
  }

  // Writes what was found to the caller's places. Coordinates and margins are gone after that.
  void write(CellLocations& result) const {
    for (Index i = 0; i < num_listed_; ++i) {
      prefetch(result.local, i);
      const Index p = caller(i), place = place_[i];
      const bool found = place >= 0 && cell[place] >= 0;
      result.cells[p] = found ? cell[place] : -1;
      for (int a = 0; a < D; ++a) result.local(p, a) = found ? xi[place][a] : 0;
    }
  }
  void forget_positions() {
    for (auto& axis : x) axis = {};
    margin = {};
  }

  std::array<LargeArray<double>, D> x;  // sorted coordinates, and max_lanes unused
  LargeArray<double> margin;            // greatest so far, and max_lanes unused
  LargeArray<Index> cell;               // of that margin; −1: none yet
  LargeArray<Coordinates<D>> xi;        // in that cell

 private:
  Index caller(Index listed) const { return slab_.is_whole() ? listed : slab_.points[listed]; }

  // A slab's points are here and there among the caller's: each would miss the cache.
  void prefetch(const Points& rows, Index listed) const {
    constexpr Index ahead = 24;
    if (!slab_.is_whole()) __builtin_prefetch(rows.data() + caller(std::min(listed + ahead, num_listed_ - 1)) * D);
  }

  const Boxes<D>& boxes_;
  const Slab& slab_;
  Index num_listed_;          // points of the slab, or all of the caller's
  LargeArray<Index> place_;   // of each in the sorted arrays; −1 outside the boxes
  std::vector<Index> first_;  // #boxes of the slab + 1
};

template <int D>
SlabPoints<D>::SlabPoints(const Points& points, const Boxes<D>& boxes, const Slab& slab)
    : xi(slab.num_points),
      boxes_(boxes),
      slab_(slab),
      num_listed_(slab.is_whole() ? static_cast<Index>(points.rows()) : slab.num_points),
      place_(num_listed_) {
  const std::int64_t num_boxes = (slab.last_slice + 1 - slab.first_slice) * boxes.boxes_a_slice();
  first_.assign(static_cast<std::size_t>(num_boxes) + 1, 0);
  // A point's box and position; the place of ξ is free for it yet.
  Index count = 0;
  for (Index i = 0; i < num_listed_; ++i) {
    prefetch(points, i);
    const Coordinates<D> position = points.row(caller(i)).template head<D>().transpose();
    place_[i] = -1;
    if (slab.is_whole() && !boxes.contains(position)) continue;
    std::int64_t index = boxes.box(0, position[0]) - slab.first_slice;
    for (int a = 1; a < D; ++a) index = index * boxes.size(a) + boxes.box(a, position[a]);
    place_[i] = static_cast<Index>(index);
    ++first_[index + 1];
    xi[count++] = position;
  }
  std::partial_sum(first_.begin(), first_.end(), first_.begin());
  // Rows are tested several points at a time and read beyond their ends.
  for (auto& axis : x) {
    axis = LargeArray<double>(count + max_lanes);
    std::fill_n(axis.data() + count, max_lanes, 0.0);
  }
  for (Index i = 0, kept = 0; i < num_listed_; ++i) {
    if (place_[i] < 0) continue;
    place_[i] = first_[place_[i]]++;
    for (int a = 0; a < D; ++a) x[a][place_[i]] = xi[kept][a];
    ++kept;
  }
  // The insertion advanced every box to the start of the next one.
  std::move_backward(first_.begin(), first_.end() - 1, first_.end());
  first_[0] = 0;
  margin = LargeArray<double>(count + max_lanes);
  std::fill_n(margin.data(), count + max_lanes, -infinity);
  cell = LargeArray<Index>(count);
  std::fill_n(cell.data(), count, -1);
}

// The planes of an affine cell.
template <Element E>
WeightPlanes<E::dim> weight_planes(const NodeMatrix<E>& gradient, const NodeMatrix<E>& positions) {
  static_assert(E::num_nodes == E::dim + 1, "an affine element is a simplex");
  WeightPlanes<E::dim> planes;
  const NodeVector<E> at_first = E::shape(E::nodes().row(0).transpose());
  for (int i = 0; i < E::num_nodes; ++i) {
    planes.at_first[i] = at_first[i];
    for (int a = 0; a < E::dim; ++a) planes.gradient[i][a] = gradient(i, a);
  }
  for (int a = 0; a < E::dim; ++a) planes.first[a] = positions(0, a);
  return planes;
}

// How far rounding blurs the weights of an affine cell: that of their computation, and the last place of a position, in
// which a cell far from the origin may be thin.
template <Element E>
double weight_blur(const NodeMatrix<E>& gradient, const NodeMatrix<E>& positions) {
  ReferencePoint<E> blur = 32 * cell_extent<E>(positions);
  for (int a = 0; a < E::dim; ++a) blur[a] += positions.col(a).cwiseAbs().maxCoeff();
  double greatest = 0;
  for (int i = 0; i < E::num_nodes; ++i) {
    double sum = 0;
    for (int a = 0; a < E::dim; ++a) sum += std::abs(gradient(i, a)) * blur[a];
    greatest = std::max(greatest, sum);
  }
  return std::numeric_limits<double>::epsilon() * greatest;
}

// An affine cell ready for tests. Flattened: small fixed-size products that are not inlined cost more than they
// compute.
template <Element E>
struct AffineCell {
  InverseMap<E> map;
  WeightPlanes<E::dim> planes;
  double least = infinity;

  [[gnu::flatten]] AffineCell(const NodeMatrix<E>& positions, double tolerance) : map(positions) {
    if (map.degenerate()) return;
    const NodeMatrix<E> gradient = map.weight_gradient();
    planes = weight_planes<E>(gradient, positions);
    least = -std::max(tolerance, weight_blur<E>(gradient, positions));
  }
  [[gnu::flatten]] ReferencePoint<E> xi(const ReferencePoint<E>& position) const { return map(position).xi; }
};

// What a thread needs from cell to cell.
struct ClaimBuffers {
  std::vector<PointRange> rows;
  std::vector<Index> claimed;
};

// Tests one cell against the points of its rows. A claim sets ξ at once, while the cell's map is at hand: few points
// are claimed more than once.
template <Element E>
void claim(const Mesh& mesh, const ElementBlock<E>& block, Eigen::Index row, Index cell, double tolerance,
           SlabPoints<E::dim>& points, ClaimBuffers& buffers) {
  const Bounds<E::dim> bounds = cell_bounds(mesh, block, row, tolerance);
  if (!points.meets(bounds)) return;
  if constexpr (E::affine) {
    buffers.rows.clear();
    Index num_points = 0;
    points.for_each_row(bounds, [&](Index begin, Index end) {
      buffers.rows.push_back({begin, end});
      num_points += end - begin;
    });
    if (num_points == 0) return;
    const AffineCell<E> affine(node_positions(mesh, block, row), tolerance);
    if (affine.map.degenerate()) return;
    if (static_cast<Index>(buffers.claimed.size()) < num_points) buffers.claimed.resize(num_points);
    PlaneTest<E::dim> test{affine.planes, affine.least, {}, points.margin.data()};
    for (int a = 0; a < E::dim; ++a) test.x[a] = points.x[a].data();
    const Index num_claimed = raise_margins(test, buffers.rows, buffers.claimed.data());
    for (Index i = 0; i < num_claimed; ++i) {
      const Index p = buffers.claimed[i];
      points.cell[p] = cell;
      points.xi[p] = affine.xi(points.position(p));
    }
  } else {
    std::optional<InverseMap<E>> map;
    points.for_each_row(bounds, [&](Index begin, Index end) {
      for (Index p = begin; p < end; ++p) {
        const Coordinates<E::dim> position = points.position(p);
        if (!bounds.contains(position)) continue;
        if (!map) map.emplace(node_positions(mesh, block, row));
        if (map->degenerate()) return;
        if (map->surely_outside(position, tolerance)) continue;
        const InverseMapResult<E> result = (*map)(position);
        if (!result.converged) continue;
        const double margin = E::margin(result.xi);
        if (margin < -tolerance || margin <= points.margin[p]) continue;
        points.margin[p] = margin;
        points.cell[p] = cell;
        points.xi[p] = result.xi;
      }
    });
  }
}

// Cuts the boxes into slabs of about equal numbers of points: several for each thread where there are threads, and none
// much larger than max_slab_points. `members` takes the points, slab by slab.
template <int D>
std::vector<Slab> make_slabs(const Points& points, const Boxes<D>& boxes, Index num_points, Index num_cells,
                             LargeArray<Index>& members) {
  // A slab costs the cells that it shares with its neighbours: cheap where there are many points for a cell.
  const Index max_slab_points = std::clamp(num_cells, 1 << 11, 1 << 17) << 3;
  const int num_slices = boxes.size(0);
  const Index num_wanted = std::max(num_threads() == 1 ? 1 : 4 * num_threads(), (num_points - 1) / max_slab_points + 1);
  if (num_wanted == 1 || num_slices == 1) return {{0, num_slices - 1, nullptr, num_points, {}}};
  const auto all = static_cast<Index>(points.rows());
  LargeArray<int> slice_of(all);
  std::vector<Index> count(num_slices, 0);
  for (Index p = 0; p < all; ++p) {
    const Coordinates<D> position = points.row(p).template head<D>().transpose();
    slice_of[p] = boxes.contains(position) ? boxes.box(0, position[0]) : -1;
    if (slice_of[p] >= 0) ++count[slice_of[p]];
  }
  std::vector<Slab> slabs;
  std::vector<std::size_t> slab_of(num_slices);
  std::vector<Index> next;  // of each slab: where its next point goes
  Index before = 0;
  members = LargeArray<Index>(num_points);
  for (int slice = 0; slice < num_slices; ++slice) {
    const auto share = static_cast<std::int64_t>(slabs.size()) * num_points / num_wanted;
    if (slabs.empty() || (before >= share && before < num_points)) {
      slabs.push_back({slice, slice, members.data() + before, 0, {}});
      next.push_back(before);
    }
    slabs.back().last_slice = slice;
    slabs.back().num_points += count[slice];
    slab_of[slice] = slabs.size() - 1;
    before += count[slice];
  }
  for (Index p = 0; p < all; ++p)
    if (slice_of[p] >= 0) members[next[slab_of[slice_of[p]]]++] = p;
  return slabs;
}

// Gives each slab its own list of cells, so that none reads cells it does not need.
template <int D>
void list_cells(const Mesh& mesh, const Boxes<D>& boxes, double tolerance, std::vector<Slab>& slabs) {
  std::vector<std::size_t> slab_of;
  for (std::size_t s = 0; s < slabs.size(); ++s) slab_of.resize(slabs[s].last_slice + 1, s);
  for_each_block_of_dim<D>(mesh, [&]<Element E>(const ElementBlock<E>& block, Index) {
    for (Slab& slab : slabs) slab.rows.emplace_back();
    for (Eigen::Index c = 0; c < block.cells.rows(); ++c) {
      const Bounds<D> bounds = cell_bounds(mesh, block, c, tolerance);
      if (!boxes.meets(bounds)) continue;
      const std::size_t last = slab_of[boxes.box(0, bounds.high[0])];
      for (std::size_t s = slab_of[boxes.box(0, bounds.low[0])]; s <= last; ++s)
        slabs[s].rows.back().push_back(static_cast<Index>(c));
    }
  });
}

template <int D>
CellLocations locate_in(const Mesh& mesh, const Points& points, double tolerance) {
  const CellStatistics<D> cells = cell_statistics<D>(mesh, tolerance);
  const auto coordinates = points.template leftCols<D>();
  Bounds<D> bounds;
  Index num_points = 0;
  for (Index p = 0; p < static_cast<Index>(points.rows()); ++p) {
    const Coordinates<D> position = coordinates.row(p).transpose();
    if (!cells.bounds.contains(position)) continue;
    bounds.include(position);
    ++num_points;
  }
  const Boxes<D> boxes(bounds, num_points, cells, mesh.num_cells());
  LargeArray<Index> members;
  std::vector<Slab> slabs = make_slabs<D>(points, boxes, num_points, mesh.num_cells(), members);
  const bool whole = slabs[0].is_whole();
  if (!whole) list_cells<D>(mesh, boxes, tolerance, slabs);

  CellLocations result;
  const auto make_result = [&] {
    reserve_large(result.cells, points.rows());
    result.cells.assign(points.rows(), -1);
    result.local.resize(points.rows(), D);
    use_large_pages(result.local.data(), result.local.size() * sizeof(double));
  };
  if (!whole) {
    make_result();
    if (num_points < points.rows()) result.local.setZero();
  }
  // Slabs own their points, so that threads share nothing. Every slab sees the cells in ascending order: a later cell
  // wins by a greater margin only, which leaves ties to the lowest number.
  parallel_for(static_cast<std::int64_t>(slabs.size()), 1, [&](std::int64_t begin, std::int64_t end) {
    ClaimBuffers buffers;
    for (std::int64_t s = begin; s < end; ++s) {
      SlabPoints<D> slab_points(points, boxes, slabs[s]);
      std::size_t b = 0;
      for_each_block_of_dim<D>(mesh, [&]<Element E>(const ElementBlock<E>& block, Index first) {
        const Index num_rows =
            whole ? static_cast<Index>(block.cells.rows()) : static_cast<Index>(slabs[s].rows[b].size());
        for (Index i = 0; i < num_rows; ++i) {
          const Index row = whole ? i : slabs[s].rows[b][i];
          claim<E>(mesh, block, row, first + row, tolerance, slab_points, buffers);
        }
        ++b;
      });
      slab_points.forget_positions();
      if (whole) make_result();  // not before: that would be the most memory at a time
      slab_points.write(result);
    }
  });
  return result;
}

template <int D>
CellLocations locate_from(const Mesh& mesh, const Points& points, double tolerance) {
  if constexpr (D < Elements::max_dim)
    if (mesh.gdim() > D) return locate_from<D + 1>(mesh, points, tolerance);
  return locate_in<D>(mesh, points, tolerance);
}

}  // namespace

CellLocations locate(const Mesh& mesh, const Points& points, double tolerance) {
  return locate_from<1>(mesh, points, tolerance);
}

}  // namespace halfgrad
