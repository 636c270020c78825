// The edges of simplices in windows of consecutive runs, as the frame reads them (kernels/cell_polynomial.hpp).
#pragma once

#include <array>
#include <utility>
#include <vector>

#include "framework/kernels/cell_polynomial.hpp"
#include "framework/large_array.hpp"

namespace halfgrad {

template <class Scalar>
struct EdgeWindows {
  std::vector<Index> first;
  std::vector<std::array<Index, 2>> ends;
  std::vector<Scalar> vectors;
  std::vector<std::uint16_t> of_run;
  std::vector<std::uint8_t> reversed;

  kernels::Edges<Scalar> view() const {
    return {first.data(), ends.data()->data(), vectors.data(), of_run.data(), reversed.data()};
  }
};

/// `nodes` are the vertices of each run; `edge(run, i, j)` is X_j − X_i in double: differences of positions in float
/// would keep no digits of a short edge.
template <int dim, class Scalar, class Nodes, class Edge>
EdgeWindows<Scalar> edge_windows(const Nodes& nodes, const Edge& edge) {
  constexpr int num_edges = kernels::num_edges(dim);
  // Open addressing; a slot of an earlier window counts as empty. Twice the edges that a window can have, or more.
  struct Slot {
    Index low, high, edge = -1;
  };
  constexpr unsigned bits = 11;
  static_assert((1 << bits) >= 2 * num_edges * kernels::window_size);
  std::vector<Slot> slots(std::size_t{1} << bits);
  const auto num_runs = static_cast<Index>(nodes.size());
  EdgeWindows<Scalar> result;
  reserve_large(result.of_run, nodes.size() * num_edges);
  result.of_run.resize(nodes.size() * num_edges);
  result.reversed.resize(nodes.size());
  // Room for edges that no two runs share; what is not used is never touched.
  reserve_large(result.ends, nodes.size() * num_edges);
  reserve_large(result.vectors, nodes.size() * num_edges * dim + kernels::vector_padding);
  for (Index run = 0; run < num_runs; ++run) {
    const auto num_before = static_cast<Index>(result.ends.size());
    if (run % kernels::window_size == 0) result.first.push_back(num_before);
    const Index window_begin = result.first.back();
    std::uint8_t reversed = 0;
    std::uint16_t* of_run = &result.of_run[static_cast<std::size_t>(run) * num_edges];
    for (int i = 0; i < dim; ++i)
      for (int j = i + 1; j <= dim; ++j) {
        const auto [low, high] = std::minmax(nodes[run][i], nodes[run][j]);
        std::uint64_t at =
            (static_cast<std::uint64_t>(low) << 32 | static_cast<std::uint32_t>(high)) * 0x9e3779b97f4a7c15ull >>
            (64 - bits);
        while (slots[at].edge >= window_begin && (slots[at].low != low || slots[at].high != high))
          at = (at + 1) & (slots.size() - 1);
        if (slots[at].edge < window_begin) {
          slots[at] = {low, high, static_cast<Index>(result.ends.size())};
          result.ends.push_back({nodes[run][i], nodes[run][j]});
          const Eigen::Matrix<double, dim, 1> vector = edge(run, i, j);
          for (int k = 0; k < dim; ++k) result.vectors.push_back(static_cast<Scalar>(vector[k]));
        }
        *of_run++ = static_cast<std::uint16_t>(slots[at].edge - window_begin);
        if (result.ends[slots[at].edge][0] != nodes[run][i])
          reversed |= static_cast<std::uint8_t>(1 << kernels::edge_number(dim, i, j));
      }
    result.reversed[run] = reversed;
  }
  result.first.push_back(static_cast<Index>(result.ends.size()));
  shrink_large(result.ends);
  result.vectors.resize(result.vectors.size() + kernels::vector_padding);
  shrink_large(result.vectors);
  return result;
}

}  // namespace halfgrad
