// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// What nvcc and the host compiler must agree on. Shared code uses + - * / sqrt and fmaf only: IEEE
// defines each of them, so the same source gives the same bits on both sides (the build switches
// contraction off, see cmake/gpureg_target.cmake).
#include <cmath>
#include <cstdint>

#if defined(__CUDACC__)
#define GPUREG_HD __host__ __device__ __forceinline__
#else
#define GPUREG_HD inline
#endif
