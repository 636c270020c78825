// Points that show a mesh finely: its triangles, or in space its surface, cut into small triangles.
#pragma once

#include "experiments/point_source.hpp"

namespace halfgrad {

/// Each cell of a plane mesh or of a surface, or each boundary facet of a body in space, cut into triangles, every edge
/// in `subdivisions` parts. Facets share no points, so that each shows its own cell.
PointCloud tessellation(const Mesh& mesh, int subdivisions);

}  // namespace halfgrad
