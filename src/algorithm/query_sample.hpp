// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <algorithm>
#include <array>

#include "math/philox.hpp"

namespace gpureg {

constexpr std::uint32_t kTagQuery = 0x51555259u;  ///< "QURY", see kTagMatch

/// The rows that one search asks for: all, or a random one of each of `count` ranges of equal
/// length. A pair keeps a limited number of matches, so more queries than that limit asks for are
/// work thrown away. Neighbouring rows are neighbouring points, so the sample covers the cloud
/// evenly.
struct QuerySample {
  std::uint32_t rows = 0, count = 0;  ///< count <= rows
  std::uint32_t search = 0;           ///< number of the search in its pair: each draws other rows
  std::uint64_t seed = 0;

  /// Row number k of the sample, ascending in k < count.
  GPUREG_HD std::uint32_t row(std::uint32_t k) const {
    if (count == rows) return k;
    const std::uint32_t begin = begin_of(k);
    const PhiloxWords w = philox(k, search, rows, kTagQuery, static_cast<std::uint32_t>(seed),
                                 static_cast<std::uint32_t>(seed >> 32));
    return begin + scale_to(w.v[0], begin_of(k + 1) - begin);
  }

  /// The only k with which row(k) may be this row, for count > 0.
  GPUREG_HD std::uint32_t place_of(std::uint32_t one) const {
    return static_cast<std::uint32_t>(((std::uint64_t(one) + 1) * count - 1) / rows);
  }

 private:
  GPUREG_HD std::uint32_t begin_of(std::uint32_t k) const {
    return static_cast<std::uint32_t>(std::uint64_t(k) * rows / count);
  }
};

/// Samples of the searches of a pair: source in target and target in source, then the same with
/// wide features if there are `searches` = 4. All searches together ask for 1.37 times the matches
/// that are kept, as some rows have no feature and some matches are found twice (a quarter of
/// them in rooms). What the smaller cloud does not need goes to the larger one.
inline std::array<QuerySample, 4> query_samples(std::uint32_t sources, std::uint32_t targets,
                                                std::uint32_t searches, std::uint32_t most_matches,
                                                std::uint64_t seed) {
  const std::uint64_t divisor = std::uint64_t(100) * searches,
                      quota = (std::uint64_t(137) * most_matches + divisor - 1) / divisor;
  const auto count = [&](std::uint32_t own, std::uint32_t other) {
    const std::uint64_t spare = own > other ? quota - std::min<std::uint64_t>(quota, other) : 0;
    return static_cast<std::uint32_t>(std::min<std::uint64_t>(own, quota + spare));
  };
  std::array<QuerySample, 4> out;
  for (std::uint32_t k = 0; k < searches; ++k)
    out[k] = k % 2 == 0 ? QuerySample{sources, count(sources, targets), k, seed}
                        : QuerySample{targets, count(targets, sources), k, seed};
  return out;
}

}  // namespace gpureg
