// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "gpureg/registration/scale.hpp"

namespace gpureg::reconstruction {

/// What the search of a pair says of its scale: that of the source to the target.
struct SearchedPair {
  std::size_t source = 0, target = 0;
  std::vector<ScaleCandidate> candidates;  ///< distinct, the most confident first; may be empty
  double deviation = 0;                    ///< of the logarithm of the first
};

/// The scales that a set of pairs agrees on.
struct AgreedScales {
  std::vector<double> log_scales;      ///< of each scan, to the first one of its part
  std::vector<std::uint32_t> parts;    ///< that accepted pairs connect
  std::vector<std::uint32_t> settled;  ///< within a part: scans that loops of pairs connect
};

AgreedScales agreed_scales(std::size_t scans, const std::vector<SearchedPair>& pairs);

}  // namespace gpureg::reconstruction
