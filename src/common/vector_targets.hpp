// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdlib>
#include <cstring>

#if defined(__x86_64__) && defined(__GNUC__)
#include <immintrin.h>
#endif

/// Host code that is compiled for vectors that a processor may lack, and chosen when it runs. The
/// loops of a function template, which is inlined, become those vectors in each function that calls
/// it. Each lane does the operations of the scalar code in the same order: without fused
/// operations, which the build disables, the result is the same.
#if defined(__x86_64__) && defined(__GNUC__)
#define GPUREG_HAS_VECTOR_TARGETS 1
#define GPUREG_TARGET_8_LANES __attribute__((target("avx2")))
#ifdef __clang__
#define GPUREG_TARGET_16_LANES __attribute__((target("avx2,avx512f,avx512vl,avx512bw,avx512dq")))
#else
#define GPUREG_TARGET_16_LANES \
  __attribute__((target("avx2,avx512f,avx512vl,avx512bw,avx512dq,prefer-vector-width=512")))
#endif
#endif
#ifdef __GNUC__
#define GPUREG_ALWAYS_INLINE inline __attribute__((always_inline))
#else
#define GPUREG_ALWAYS_INLINE inline
#endif

namespace gpureg {

/// Floats in a vector of this processor: 4, 8 or 16. The environment variable GPUREG_VECTORS=narrow
/// keeps to 4, for tests and comparisons.
inline int float_lanes() {
#ifdef GPUREG_HAS_VECTOR_TARGETS
  static const int lanes = [] {
    const char* asked = std::getenv("GPUREG_VECTORS");
    if (asked != nullptr && std::strcmp(asked, "narrow") == 0) return 4;
    if (!__builtin_cpu_supports("avx2")) return 4;
    const bool wide = __builtin_cpu_supports("avx512f") && __builtin_cpu_supports("avx512vl") &&
                      __builtin_cpu_supports("avx512bw") && __builtin_cpu_supports("avx512dq");
    return wide ? 16 : 8;
  }();
  return lanes;
#else
  return 4;
#endif
}

}  // namespace gpureg
