// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "algorithm/compatibility.hpp"
#include "cuda/common/stage_data.hpp"

namespace gpureg::cuda {

/// at: of the whole batch.
__device__ inline OrientedMatch match_at(const MatchSetView& m, std::size_t at) {
  return {{m.px[at], m.py[at], m.pz[at]},
          {m.qx[at], m.qy[at], m.qz[at]},
          {m.mx[at], m.my[at], m.mz[at]},
          {m.nx[at], m.ny[at], m.nz[at]}};
}

/// A match in shared memory: three words that a warp reads at once.
struct PackedMatch {
  float4 a, b, c;
  __device__ OrientedMatch unpacked() const {
    return {{a.x, a.y, a.z}, {a.w, b.x, b.y}, {b.z, b.w, c.x}, {c.y, c.z, c.w}};
  }
};
__device__ inline PackedMatch packed(const OrientedMatch& o) {
  return {{o.p.x, o.p.y, o.p.z, o.q.x}, {o.q.y, o.q.z, o.m.x, o.m.y}, {o.m.z, o.n.x, o.n.y, o.n.z}};
}

inline CompatibilityTest test_of(const CompatibilitySettings& options) {
  return compatibility_test(options.tolerance, options.max_turn);
}

}  // namespace gpureg::cuda
