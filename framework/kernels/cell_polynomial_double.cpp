#define HALFGRAD_SCALAR double
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "framework/kernels/cell_polynomial_double.cpp"
#include "framework/kernels/cell_polynomial.inl"
