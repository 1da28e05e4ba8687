// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <vector>

#include "math/vec3.hpp"

namespace gpureg::scale {

/// Oriented points of matches, in pseudorandom order: p, m of the source at the scale of its rung,
/// q, n of the target.
struct Matches {
  std::vector<Vec3> p, m, q, n;
  std::uint32_t size() const { return static_cast<std::uint32_t>(p.size()); }
};

/// A factor that many matches agree on.
struct Proposal {
  double factor = 1;         ///< of the scale of the rung
  std::uint32_t places = 0;  ///< distinct places of the agreeing matches, in the cloud with fewer
};

/// Similarities that matches agree on, with factors near 1 (a rung and its neighbours), the
/// best-supported first. A match votes for the ratios of its distances to the others; seeds are
/// those with the most votes for one ratio, and triangles of matches with that ratio are fitted.
/// voxel: in the target's unit. Deterministic.
std::vector<Proposal> propose_factors(const Matches& matches, float voxel, std::uint64_t seed);

}  // namespace gpureg::scale
