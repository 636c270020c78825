// The one list of element types: readers, JSON names, meshes, kernels and tests derive from it.
#pragma once

#include "elements/hexahedron.hpp"
#include "elements/pyramid.hpp"
#include "elements/quadrilateral.hpp"
#include "elements/segment.hpp"
#include "elements/tetrahedron.hpp"
#include "elements/triangle.hpp"
#include "elements/wedge.hpp"

namespace halfgrad {

using Elements = ElementList<  //
    Segment,                   //
    Triangle,                  //
    Quadrilateral,             //
    Tetrahedron,               //
    Pyramid,                   //
    Wedge,                     //
    Hexahedron>;

}  // namespace halfgrad
