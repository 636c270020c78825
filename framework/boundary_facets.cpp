#include "framework/boundary_facets.hpp"

#include <algorithm>
#include <limits>
#include <numeric>

namespace halfgrad {

namespace {

// A facet under its lowest vertex; the other vertices in ascending order.
struct Candidate {
  std::array<Index, 3> others;
  CellFacet side;
};

// Calls f(lowest vertex, candidate) for every facet of the cells that count.
template <class Function>
void for_each_candidate(const Mesh& mesh, const std::vector<char>& skip, Function&& f) {
  for_each_block(mesh, [&]<Element E>(const ElementBlock<E>& block, Index first) {
    for (Eigen::Index c = 0; c < block.cells.rows(); ++c) {
      const Index cell = static_cast<Index>(first + c);
      if (skip[cell]) continue;
      for (int side = 0; side < static_cast<int>(E::facets.size()); ++side) {
        std::array<Index, 4> vertices;
        vertices.fill(std::numeric_limits<Index>::max());
        for (int i = 0; i < E::facets[side].num_nodes; ++i) vertices[i] = block.cells(c, E::facets[side].nodes[i]);
        std::sort(vertices.begin(), vertices.end());
        f(vertices[0], Candidate{{vertices[1], vertices[2], vertices[3]}, {cell, side}});
      }
    }
  });
}

// Whether two cells have the same vertices: one is the other's double.
bool same_vertices(const Mesh& mesh, Index a, Index b) {
  const std::span<const Index> first = mesh.cell_vertices(a), second = mesh.cell_vertices(b);
  return first.size() == second.size() && std::is_permutation(first.begin(), first.end(), second.begin());
}

}  // namespace

std::vector<CellFacet> boundary_facets(const Mesh& mesh, const std::vector<char>& skip) {
  // A counting sort by the lowest vertex leaves buckets of a few facets to compare.
  std::vector<Offset> first(static_cast<std::size_t>(mesh.num_vertices()) + 1, 0);
  for_each_candidate(mesh, skip, [&](Index lowest, const Candidate&) { ++first[lowest + 1]; });
  std::partial_sum(first.begin(), first.end(), first.begin());
  std::vector<Candidate> candidates(first.back());
  std::vector<Offset> next(first.begin(), first.end() - 1);
  for_each_candidate(mesh, skip,
                     [&](Index lowest, const Candidate& candidate) { candidates[next[lowest]++] = candidate; });

  std::vector<CellFacet> boundary;
  for (Index v = 0; v < mesh.num_vertices(); ++v) {
    const auto begin = candidates.begin() + first[v], end = candidates.begin() + first[v + 1];
    std::sort(begin, end, [](const Candidate& a, const Candidate& b) { return a.others < b.others; });
    for (auto i = begin; i != end;) {
      const auto j = std::find_if(i, end, [&](const Candidate& other) { return other.others != i->others; });
      const bool one_cell = std::all_of(
          i + 1, j, [&](const Candidate& other) { return same_vertices(mesh, i->side.cell, other.side.cell); });
      if (one_cell) boundary.push_back(i->side);
      i = j;
    }
  }
  std::sort(boundary.begin(), boundary.end(), [](const CellFacet& a, const CellFacet& b) {
    return std::pair(a.cell, a.facet) < std::pair(b.cell, b.facet);
  });
  return boundary;
}

}  // namespace halfgrad
