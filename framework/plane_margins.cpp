// Compiled with -ffp-contract=off: which cell wins a tie must not depend on the machine.
#include "framework/plane_margins.hpp"

// The widest vectors that the processor has, chosen at load time. Sanitizers do not run before the choice is made.
#if defined(__x86_64__) && defined(__ELF__) && defined(__GNUC__) && !defined(__clang__) && \
    !defined(__SANITIZE_ADDRESS__) && !defined(__SANITIZE_THREAD__)
#define HALFGRAD_EVERY_VECTOR_WIDTH __attribute__((target_clones("default", "avx2", "avx512f")))
#else
#define HALFGRAD_EVERY_VECTOR_WIDTH
#endif

namespace halfgrad {

namespace {

template <int D>
inline __attribute__((always_inline)) void least_weights(const WeightPlanes<D>& planes,
                                                         const std::array<const double*, D>& x,
                                                         double* __restrict margins) {
  for (int p = 0; p < num_lanes; ++p) {
    std::array<double, D> d;
    for (int a = 0; a < D; ++a) d[a] = x[a][p] - planes.first[a];
    double lowest = planes.at_first[0];
    for (int a = 0; a < D; ++a) lowest += planes.gradient[0][a] * d[a];
    for (int i = 1; i <= D; ++i) {
      double beta = planes.at_first[i];
      for (int a = 0; a < D; ++a) beta += planes.gradient[i][a] * d[a];
      lowest = beta < lowest ? beta : lowest;
    }
    margins[p] = lowest;
  }
}

}  // namespace

HALFGRAD_EVERY_VECTOR_WIDTH
void plane_margins(const WeightPlanes<1>& planes, const std::array<const double*, 1>& x, double* margins) {
  least_weights<1>(planes, x, margins);
}
HALFGRAD_EVERY_VECTOR_WIDTH
void plane_margins(const WeightPlanes<2>& planes, const std::array<const double*, 2>& x, double* margins) {
  least_weights<2>(planes, x, margins);
}
HALFGRAD_EVERY_VECTOR_WIDTH
void plane_margins(const WeightPlanes<3>& planes, const std::array<const double*, 3>& x, double* margins) {
  least_weights<3>(planes, x, margins);
}

}  // namespace halfgrad
