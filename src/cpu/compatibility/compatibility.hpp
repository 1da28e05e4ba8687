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

inline CompatibilityTest test_of(const CompatibilitySettings& options) {
  return compatibility_test(options.tolerance, options.max_turn);
}

}  // namespace gpureg::cpu
