#include "framework/kernels/targets.hpp"
#define HALFGRAD_SCALAR float
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "framework/kernels/lanes_float.cpp"
#include "framework/kernels/lanes.inl"
