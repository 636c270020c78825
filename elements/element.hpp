// The contract of an element type: what a reference cell must state so that everything else follows.
#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <array>
#include <concepts>
#include <cstddef>
#include <limits>
#include <string_view>
#include <tuple>
#include <type_traits>
#include <utility>

namespace halfgrad {

/// A facet of a reference cell: the local nodes of one side (two for a triangle's edge, four for a hexahedron's face),
/// in cyclic order.
struct Facet {
  int num_nodes;
  std::array<int, 4> nodes;
};

/// ξ of E, dim × 1.
template <class E>
using ReferencePoint = Eigen::Matrix<double, E::dim, 1>;
/// One value a node, num_nodes × 1.
template <class E>
using NodeVector = Eigen::Matrix<double, E::num_nodes, 1>;
/// One row a node, num_nodes × dim.
template <class E>
using NodeMatrix = Eigen::Matrix<double, E::num_nodes, E::dim>;

/// An element type: static facts of a reference cell, and nothing about meshes, points or gradients.
///
/// member               meaning
/// name                 the name used in JSON and reports, singular ("tetrahedron")
/// vtk_id               the VTK cell type; node order is VTK's but for the wedge, and makes det ∂x/∂ξ positive
/// dim                  dimension of the reference cell
/// num_nodes            number of nodes, which are the cell's corners
/// affine               true where x(ξ) is affine for any node positions (simplices)
/// reference_volume     volume of the reference cell
/// facets               std::array<Facet, n>: the sides, by local node
/// nodes()              num_nodes × dim, reference coordinates of the nodes
/// center()             ξ at which the cell's own gradient is taken
/// shape(ξ)             num_nodes × 1 with Σβ = 1 and Σβ_i node_i = ξ
/// shape_gradient(ξ)    num_nodes × dim, row i = ∂β_i/∂ξ
/// margin(ξ)            least reference distance to a facet: ≥ 0 inside, negative outside
template <class E>
concept Element = requires(const ReferencePoint<E>& xi) {
  { E::name } -> std::convertible_to<std::string_view>;
  { E::vtk_id } -> std::convertible_to<int>;
  { E::dim } -> std::convertible_to<int>;
  { E::num_nodes } -> std::convertible_to<int>;
  { E::affine } -> std::convertible_to<bool>;
  { E::reference_volume } -> std::convertible_to<double>;
  { E::facets.size() } -> std::convertible_to<std::size_t>;
  { E::facets[0] } -> std::convertible_to<const Facet&>;
  { E::nodes() } -> std::convertible_to<NodeMatrix<E>>;
  { E::center() } -> std::convertible_to<ReferencePoint<E>>;
  { E::shape(xi) } -> std::convertible_to<NodeVector<E>>;
  { E::shape_gradient(xi) } -> std::convertible_to<NodeMatrix<E>>;
  { E::margin(xi) } -> std::convertible_to<double>;
};

/// An element with a rational function of ξ beside the polynomials:
///
/// rational             three affine functions n_1, n_2, m, each as coefficients of 1, ξ_1, … ξ_dim; the function is
///                      n_1 n_2 / m where m > least_denominator, else 0
/// least_denominator    see rational
template <class E>
concept RationalElement = Element<E> && requires {
  { E::rational[2][E::dim] } -> std::convertible_to<double>;
  { E::least_denominator } -> std::convertible_to<double>;
};

/// The variables of shape functions: ξ, and the rational function where there is one.
template <class E>
inline constexpr int num_variables = RationalElement<E> ? E::dim + 1 : E::dim;

/// An element that also states its shape functions as polynomials in its variables η, which is what the fast path
/// evaluates:
///
/// shape_monomials      std::array of exponents: monomial m is Π_k η_k^shape_monomials[m][k]; the first is 1
/// shape_coefficients   β_i = Σ_m shape_coefficients[m][i] · monomial m; that of 1 is node 0's alone
template <class E>
concept MonomialElement = Element<E> && requires {
  { E::shape_monomials.size() } -> std::convertible_to<std::size_t>;
  { E::shape_monomials[0][num_variables<E> - 1] } -> std::convertible_to<int>;
  { E::shape_coefficients[0][E::num_nodes - 1] } -> std::convertible_to<double>;
};

/// One whose shape functions are polynomials in ξ.
template <class E>
concept PolynomialElement = MonomialElement<E> && !RationalElement<E>;

/// An element that also states how its cell is a cube, collapsed where corners share a node: by this the inverse map
/// proves that no ξ of a cell maps to a position, and elements without it are searched from a lattice of starts.
///
/// cube_nodes           std::array of 2^dim nodes, that of corner c at u_k = bit k of c. With the corners' multilinear
///                      weights w_c(u), ξ(u) = Σ_c w_c(u) node_cube_nodes[c] maps the unit cube onto the reference
///                      cell, and β_i(ξ(u)) = Σ w_c(u) over the corners c that share node i
template <class E>
concept CubeElement = Element<E> && requires {
  { E::cube_nodes[(std::size_t{1} << E::dim) - 1] } -> std::convertible_to<int>;
};

/// Whether ξ lies in the reference cell grown by `eps` (in reference lengths).
template <Element E>
bool contains(const ReferencePoint<E>& xi, double eps) {
  return E::margin(xi) >= -eps;
}

/// True for elements, ill-formed for other types. GCC explains an unmet concept of one type, but not of a pack.
template <Element E>
inline constexpr bool is_element = true;

/// An ordered list of element types. A type that is no element is refused by a message that names what it lacks.
template <class... Es>
struct ElementList {
  static_assert((is_element<Es> && ...));
  static constexpr std::size_t size = sizeof...(Es);

  /// Calls visit.operator()<E>() for each element in order.
  template <class Visitor>
  static constexpr void for_each(Visitor&& visit) {
    (visit.template operator()<Es>(), ...);
  }

  /// Greatest number of nodes and greatest dimension in the list.
  static constexpr int max_nodes = std::max({Es::num_nodes...});
  static constexpr int max_dim = std::max({Es::dim...});

  /// The template instantiated with all elements, e.g. a std::variant of blocks.
  template <template <class...> class List, template <class> class Item>
  using apply = List<Item<Es>...>;
};

}  // namespace halfgrad
