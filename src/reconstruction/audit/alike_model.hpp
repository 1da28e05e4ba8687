// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <algorithm>

#include "gpureg/reconstruction/map.hpp"
#include "math/exponential.hpp"

namespace gpureg::reconstruction {

/// Log odds that places of a set look alike, so that pairs that agree may be wrong together. Where
/// places differ, the share that contradicts falls with the square of the edges per scan, as loops
/// choose the right poses. The constants are written by bench/accuracy/fit_alike.py.
inline double alike_log_odds(const Agreement& agreement) {
  constexpr double kBias = 2.2, kContradicted = 2.07, kJumps = 5.22;
  const double edges = std::max(agreement.edges_per_scan, 0.1);
  return kBias +
         kContradicted * portable::log(std::max(agreement.contradicted, 1e-3) * edges * edges) +
         kJumps * agreement.jumps;
}

}  // namespace gpureg::reconstruction
