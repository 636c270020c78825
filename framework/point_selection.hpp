// Some of the points of an embedding.
#pragma once

#include <span>

#include "framework/embedding.hpp"

namespace halfgrad {

/// Some of the points (numbers of points of `embedding`, in any order): an interpolant bound to the result evaluates
/// these alone, without a new search. Throws Error on a number out of range.
Embedding select_points(const Embedding& embedding, std::span<const Index> points);

}  // namespace halfgrad
