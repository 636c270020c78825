#include "framework/mesh_faults.hpp"

#include <algorithm>
#include <bit>

namespace halfgrad {

namespace {

// The numbers from 0 to count − 1 whose item equals that of a lower number.
template <class Hash, class Equal>
std::vector<Index> later_twins(Index count, Hash&& hash, Equal&& equal) {
  const std::size_t mask = std::bit_ceil(2 * static_cast<std::size_t>(count) + 1) - 1;
  std::vector<Index> first_of(mask + 1, -1), twins;
  for (Index i = 0; i < count; ++i) {
    std::size_t at = hash(i) & mask;
    while (first_of[at] >= 0 && !equal(first_of[at], i)) at = (at + 1) & mask;
    if (first_of[at] < 0)
      first_of[at] = i;
    else
      twins.push_back(i);
  }
  return twins;
}

std::uint64_t mixed(std::uint64_t hash, std::uint64_t more) {
  hash = (hash ^ more) * 0x9e3779b97f4a7c15;
  return hash ^ hash >> 29;
}

}  // namespace

std::vector<Index> duplicate_vertices(const Mesh& mesh) {
  const Points& vertices = mesh.vertices();
  return later_twins(
      mesh.num_vertices(),
      [&](Index v) {
        std::uint64_t hash = 0;
        // −0 + 0 is 0, which it equals.
        for (double x : vertices.row(v)) hash = mixed(hash, std::bit_cast<std::uint64_t>(x + 0.0));
        return hash;
      },
      [&](Index v, Index w) { return vertices.row(v) == vertices.row(w); });
}

std::vector<Index> duplicate_cells(const Mesh& mesh) {
  std::vector<std::array<Index, max_nodes>> cells;
  cells.reserve(mesh.num_cells());
  for_each_block(mesh, [&]<Element E>(const ElementBlock<E>& block, Index) {
    for (Eigen::Index c = 0; c < block.cells.rows(); ++c) {
      auto& cell = cells.emplace_back();
      cell.fill(-1);
      std::copy_n(block.cells.row(c).data(), E::num_nodes, cell.data());
      std::sort(cell.begin(), cell.begin() + E::num_nodes);
    }
  });
  return later_twins(
      mesh.num_cells(),
      [&](Index c) {
        std::uint64_t hash = 0;
        for (Index v : cells[c]) hash = mixed(hash, static_cast<std::uint64_t>(v));
        return hash;
      },
      [&](Index c, Index d) { return cells[c] == cells[d]; });
}

std::vector<FacetKey> nonmanifold_facets(const Mesh& mesh) {
  std::vector<FacetKey> facets, shared;
  for_each_block(mesh, [&]<Element E>(const ElementBlock<E>& block, Index) { append_facets(block, facets); });
  std::sort(facets.begin(), facets.end());
  for (auto facet = facets.begin(); facet != facets.end();) {
    const auto end = std::upper_bound(facet, facets.end(), *facet);
    if (end - facet > 2) shared.push_back(*facet);
    facet = end;
  }
  return shared;
}

}  // namespace halfgrad
