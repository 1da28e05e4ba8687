// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <cstring>

#include "common/vector_targets.hpp"

#if defined(__AVX2__) && defined(__FMA__) && defined(GPUREG_HAS_VECTOR_TARGETS)
#define GPUREG_WIDE_TARGET GPUREG_TARGET_16_LANES
/// The same with products of bytes.
#ifdef __clang__
#define GPUREG_BYTE_TARGET __attribute__((target("avx512f,avx512vl,avx512bw,avx512dq,avx512vnni")))
#else
#define GPUREG_BYTE_TARGET \
  __attribute__((target("avx512f,avx512vl,avx512bw,avx512dq,avx512vnni,prefer-vector-width=512")))
#endif
#endif

namespace gpureg::cpu {

constexpr std::uint32_t kMaskBits = 64;

/// Bits of 64 flags, each 0 or 1.
struct NarrowMask {
  GPUREG_ALWAYS_INLINE static std::uint64_t of(const std::uint8_t* flags) {
    std::uint64_t mask = 0;
    for (std::uint32_t k = 0; k < kMaskBits / 8; ++k) {
      std::uint64_t eight;
      std::memcpy(&eight, flags + 8 * k, 8);
      mask |= (eight * 0x0102040810204080u >> 56) << 8 * k;
    }
    return mask;
  }
};
#ifdef GPUREG_WIDE_TARGET
struct WideMask {
  GPUREG_WIDE_TARGET static std::uint64_t of(const std::uint8_t* flags) {
    const __m512i all = _mm512_loadu_si512(flags);
    return _mm512_test_epi8_mask(all, all);
  }
};
#endif

/// Whether the build has functions for vectors of 16 floats (AVX-512), and the processor runs them.
inline bool has_wide_vectors() {
#ifdef GPUREG_WIDE_TARGET
  return float_lanes() == 16;
#else
  return false;
#endif
}

/// Whether it also has functions with products of bytes (AVX-512 VNNI).
inline bool has_byte_products() {
#ifdef GPUREG_WIDE_TARGET
  static const bool has = has_wide_vectors() && __builtin_cpu_supports("avx512vnni");
  return has;
#else
  return false;
#endif
}

}  // namespace gpureg::cpu
