// The edges of simplices in windows of consecutive runs, as the frame reads them (kernels/cell_polynomial.hpp).
#pragma once

#include <algorithm>
#include <array>
#include <vector>

#include "framework/kernels/cell_polynomial.hpp"
#include "framework/large_array.hpp"

namespace halfgrad {

template <class Scalar>
struct EdgeWindows {
  std::vector<Index> first;
  LargeArray<std::array<Index, 2>> ends;
  LargeArray<Scalar> vectors;
  LargeArray<std::uint16_t> of_run;
  std::vector<std::uint8_t> reversed;

  kernels::Edges<Scalar> view() const {
    return {first.data(), ends.data()->data(), vectors.data(), of_run.data(), reversed.data()};
  }
};

/// `nodes` are the vertices of each run; `position(node)` is in double: differences of positions in float would keep no
/// digits of a short edge.
template <int dim, class Scalar, class Nodes, class Position>
EdgeWindows<Scalar> edge_windows(const Nodes& nodes, const Position& position) {
  constexpr int num_pairs = kernels::num_edges(dim);
  // Open addressing; a slot of an earlier window counts as empty. Twice the edges that a window can have, or more.
  struct Slot {
    Index low, high, edge = -1;
  };
  constexpr unsigned bits = 11;
  static_assert((1 << bits) >= 2 * num_pairs * kernels::window_size);
  std::vector<Slot> slots(std::size_t{1} << bits);
  const auto num_runs = static_cast<Index>(nodes.size());
  EdgeWindows<Scalar> result;
  result.of_run = LargeArray<std::uint16_t>(nodes.size() * num_pairs);
  result.reversed.resize(nodes.size());
  // Room for edges that no two runs share.
  result.ends = LargeArray<std::array<Index, 2>>(nodes.size() * num_pairs);
  result.vectors = LargeArray<Scalar>(nodes.size() * num_pairs * dim + kernels::vector_padding);
  Index num_edges = 0;
  for (Index run = 0; run < num_runs; ++run) {
    if (run % kernels::window_size == 0) result.first.push_back(num_edges);
    const Index window_begin = result.first.back();
    Eigen::Matrix<double, dim, dim + 1> positions;
    for (int i = 0; i <= dim; ++i) positions.col(i) = position(nodes[run][i]);
    unsigned reversed = 0;
    int pair = 0;
    for (int i = 0; i < dim; ++i)
      for (int j = i + 1; j <= dim; ++j, ++pair) {
        const Index from = nodes[run][i], to = nodes[run][j], low = std::min(from, to), high = std::max(from, to);
        std::uint64_t hash =
            (static_cast<std::uint64_t>(low) << 32 | static_cast<std::uint32_t>(high)) * 0x9e3779b97f4a7c15ull >>
            (64 - bits);
        while (slots[hash].edge >= window_begin && (slots[hash].low != low || slots[hash].high != high))
          hash = (hash + 1) & (slots.size() - 1);
        // Written whether it is new or not: every second one is, and a branch would be taken at random.
        Slot& slot = slots[hash];
        const bool is_new = slot.edge < window_begin;
        const Index edge = is_new ? num_edges : slot.edge;
        slot = {low, high, edge};
        result.ends[num_edges] = {from, to};
        for (int k = 0; k < dim; ++k)
          result.vectors[static_cast<std::size_t>(num_edges) * dim + k] =
              static_cast<Scalar>(positions(k, j) - positions(k, i));
        num_edges += is_new;
        result.of_run[static_cast<std::size_t>(run) * num_pairs + pair] =
            static_cast<std::uint16_t>(edge - window_begin);
        reversed |= unsigned{result.ends[edge][0] != from} << pair;
      }
    result.reversed[run] = static_cast<std::uint8_t>(reversed);
  }
  result.first.push_back(num_edges);
  const std::size_t num_components = static_cast<std::size_t>(num_edges) * dim;
  result.ends.shrink(num_edges);
  result.vectors.shrink(num_components + kernels::vector_padding);
  std::fill_n(result.vectors.data() + num_components, kernels::vector_padding, Scalar(0));
  return result;
}

}  // namespace halfgrad
