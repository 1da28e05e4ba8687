// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <vector>

#include "api/access.hpp"
#include "gpureg/registration.hpp"
#include "gpureg/result.hpp"

namespace gpureg {

/// One way to take the sides of both clouds of a pair.
struct PairVariant {
  std::size_t pair;  ///< index into the pairs
  const PreparedState* source;
  const PreparedState* target;
};

/// Each pair once, or with both sides of every cloud whose sides are unknown. The variants of a
/// pair are neighbours.
inline std::vector<PairVariant> variants_of(const std::vector<PreparedCloud>& clouds,
                                            const std::vector<Pair>& pairs) {
  std::vector<PairVariant> out;
  for (std::size_t p = 0; p < pairs.size(); ++p) {
    const PreparedState* source = Access::state(clouds[pairs[p].source]).get();
    const PreparedState* target = Access::state(clouds[pairs[p].target]).get();
    for (const PreparedState* s :
         {source, static_cast<const PreparedState*>(source->other_sides.get())})
      for (const PreparedState* t :
           {target, static_cast<const PreparedState*>(target->other_sides.get())})
        if (s && t) out.push_back({p, s, t});
  }
  return out;
}

/// Keeps the result with the higher confidence, up to a symmetry, the first one of equals, and the
/// time of both.
inline void keep_better(RegistrationResult&& candidate, RegistrationResult& kept) {
  const bool first = kept.status == RegistrationStatus::skipped;
  StageTimings sum = candidate.timings;
  sum += kept.timings;
  const auto better = [&] {
    if (candidate.has_pose() != kept.has_pose()) return candidate.has_pose();
    const double together = candidate.symmetry_confidence(), before = kept.symmetry_confidence();
    if (together != before) return together > before;
    return candidate.confidence > kept.confidence;
  };
  if (first || better()) kept = std::move(candidate);
  kept.timings = sum;
}

}  // namespace gpureg
