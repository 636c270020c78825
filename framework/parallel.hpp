// Threads, in one place. The number of threads is the caller's: run inside a tbb::task_arena, or set
// tbb::global_control; halfgrad adds no setting of its own.
#pragma once

#include <cstdint>
#include <functional>

namespace halfgrad {

/// Calls body(begin, end) on disjoint ranges that cover [0, count), on the calling thread where count ≤ grain. Results
/// must not depend on the ranges; the first exception thrown by a body is rethrown.
void parallel_for(std::int64_t count, std::int64_t grain,
                  const std::function<void(std::int64_t begin, std::int64_t end)>& body);

/// Number of threads that parallel_for may use here.
int num_threads();

}  // namespace halfgrad
