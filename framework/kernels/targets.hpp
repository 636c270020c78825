// Which instruction sets the kernels are compiled for. Included before any header of Highway.
#pragma once

// One target for each width of vectors; sizeless vectors (SVE, RVV) cannot be members, as `Four` has them.
#define HWY_DISABLED_TARGETS (HWY_SSSE3 | HWY_AVX3_DL | HWY_SVE | HWY_SVE2 | HWY_SVE_256 | HWY_SVE2_128 | HWY_RVV)
