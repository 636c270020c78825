#include "framework/kernels/targets.hpp"
#define HALFGRAD_SCALAR double
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "framework/kernels/weighted_stage_double.cpp"
#include "framework/kernels/weighted_stage.inl"
