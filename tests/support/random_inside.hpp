// Points of reference cells.
#pragma once

#include <random>

#include "elements/element.hpp"

namespace halfgrad::test {

/// ξ uniformly inside a reference cell.
template <Element E>
ReferencePoint<E> random_inside(std::mt19937& random) {
  const NodeMatrix<E> nodes = E::nodes();
  std::uniform_real_distribution<double> uniform(0, 1);
  ReferencePoint<E> xi;
  do {
    for (int a = 0; a < E::dim; ++a) {
      const double low = nodes.col(a).minCoeff(), high = nodes.col(a).maxCoeff();
      xi[a] = low + (high - low) * uniform(random);
    }
  } while (!contains<E>(xi, 0));
  return xi;
}

}  // namespace halfgrad::test
