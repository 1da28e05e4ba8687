// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "algorithm/compatibility.hpp"
#include "cpu/common/stage_data.hpp"

namespace gpureg::cpu {

/// Pointers to the coordinates of matches, one array each: the compiler vectorises loops over them.
struct MatchColumns {
  const float *px, *py, *pz, *qx, *qy, *qz, *mx, *my, *mz, *nx, *ny, *nz;
  explicit MatchColumns(const MatchSet& m, std::size_t from = 0)
      : px(&m.px[from]),
        py(&m.py[from]),
        pz(&m.pz[from]),
        qx(&m.qx[from]),
        qy(&m.qy[from]),
        qz(&m.qz[from]),
        mx(&m.mx[from]),
        my(&m.my[from]),
        mz(&m.mz[from]),
        nx(&m.nx[from]),
        ny(&m.ny[from]),
        nz(&m.nz[from]) {}
  OrientedMatch operator[](std::size_t k) const {
    return {
        {px[k], py[k], pz[k]}, {qx[k], qy[k], qz[k]}, {mx[k], my[k], mz[k]}, {nx[k], ny[k], nz[k]}};
  }
};

inline CompatibilityTest test_of(const CompatibilityOptions& options) {
  return compatibility_test(options.tolerance, options.max_turn);
}

/// Calls take(k) for all compatible matches of one match, in their order, until it returns false.
template <typename Take>
void for_each_compatible(const MatchSet& matches, std::uint32_t seed, const CompatibilityTest& test,
                         Take&& take) {
  constexpr std::uint32_t kBlock = 256;
  const OrientedMatch own = MatchColumns(matches)[seed];
  std::uint8_t flag[kBlock];
  for (std::uint32_t from = 0; from < matches.size(); from += kBlock) {
    const std::uint32_t count = matches.size() - from < kBlock ? matches.size() - from : kBlock;
    const MatchColumns block(matches, from);
    for (std::uint32_t k = 0; k < count; ++k) flag[k] = compatible(block[k], own, test);
    for (std::uint32_t k = 0; k < count; ++k)
      if (flag[k] && !take(from + k)) return;
  }
}

}  // namespace gpureg::cpu
