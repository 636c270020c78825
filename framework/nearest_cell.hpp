// The closest point of a mesh to a point outside it.
#pragma once

#include <array>
#include <vector>

#include "framework/boundary_facets.hpp"

namespace halfgrad {

/// The closest point of a facet: a weighted mean of the facet's nodes.
struct FacetPoint {
  double squared_distance = 0;      ///< in length units squared
  std::array<double, 4> weights{};  ///< one a node of the facet, ≥ 0, sum one
};

/// A tree of boxes over boundary facets, or over the cells of a surface. The mesh must outlive it.
class NearestCell {
 public:
  struct Result {
    CellFacet side;
    FacetPoint point;
  };

  NearestCell(const Mesh& mesh, std::vector<CellFacet> facets);
  /// Throws nothing; `position` is gdim and finite, and there is at least one facet. Ties go to the lowest cell.
  Result find(const Vector& position) const;

 private:
  struct Box {
    Vector low, high;
    Index begin, end;  // facets of a leaf; children of an inner node are at box + 1 and at `end`
    bool leaf;
  };
  Index build(Index begin, Index end);
  double squared_distance(const Box& box, const Vector& position) const;

  const Mesh* mesh_;
  std::vector<CellFacet> facets_;
  std::vector<Box> boxes_;
};

}  // namespace halfgrad
