// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <algorithm>

#include "gpureg/reconstruction/map.hpp"
#include "math/exponential.hpp"

namespace gpureg::reconstruction {

/// Log odds that places of a set look alike, so that pairs that agree may be wrong together. Pairs
/// of distinct places contradict each other the less the more pairs a scan has, as loops choose the
/// right poses. Written by bench/accuracy/fit_alike.py.
inline double alike_log_odds(const Agreement& agreement) {
  constexpr double kBias = 2.4, kContradicted = 3, kEdgesPerScan = 6, kJumps = 10;
  return kBias + kContradicted * portable::log(std::max(agreement.contradicted, 1e-3)) +
         kEdgesPerScan * portable::log(std::max(agreement.edges_per_scan, 0.1)) +
         kJumps * agreement.jumps;
}

}  // namespace gpureg::reconstruction
