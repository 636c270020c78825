#define HALFGRAD_SCALAR float
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "framework/kernels/cell_polynomial_float.cpp"
#include "framework/kernels/cell_polynomial.inl"
