// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// Shared code of nvcc and the host compiler uses + - * / sqrt and fmaf only: IEEE defines each of
// them, so the same source gives the same bits on both sides (the build disables contraction, see
// cmake/gpureg_target.cmake).
#include <cmath>
#include <cstdint>

#if defined(__CUDACC__)
#define GPUREG_HD __host__ __device__ __forceinline__
#else
#define GPUREG_HD inline
#endif
