// The numeric types that all layers share.
#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <cstdint>

#include "elements/registry.hpp"

namespace halfgrad {

/// Number of a vertex, cell or point.
using Index = std::int32_t;
/// Position in a compressed table.
using Offset = std::int64_t;

/// Greatest space dimension: that of the registered elements, and space-time (Simplex<4>).
inline constexpr int max_gdim = std::max(Elements::max_dim, 4);
/// Greatest number of nodes of a cell, registered or not.
inline constexpr int max_nodes = std::max(Elements::max_nodes, 8);

/// Positions, #rows × gdim, row-major, always double.
using Points = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;
/// Values carried by vertices or points, #rows × #columns, row-major.
template <class Scalar>
using Values = Eigen::Matrix<Scalar, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;
/// A vector of the space, gdim × 1, without heap.
using Vector = Eigen::Matrix<double, Eigen::Dynamic, 1, Eigen::ColMajor, max_gdim, 1>;
/// One row a node of a cell, #nodes × gdim, without heap.
using NodeRows = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor, max_nodes, max_gdim>;
/// A square matrix of the space, gdim × gdim, without heap.
using SmallMatrix = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::ColMajor, max_gdim, max_gdim>;

/// Number of independent entries of a symmetric gdim × gdim matrix, ordered (0,0) (0,1) … (0,d−1) (1,1) … (d−1,d−1).
constexpr int num_symmetric(int gdim) { return gdim * (gdim + 1) / 2; }

}  // namespace halfgrad
