// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <vector>

#include "pipeline/types.hpp"
#include "support/result_bytes.hpp"

namespace gpureg::test {

inline void add(ByteWriter& out, const SideEvidence& e) { out.add(e.sum); }
inline void add(ByteWriter& out, const MatchEvidence& e) {
  out.add(e.source_weight, e.target_weight, e.inliers);
}

inline std::vector<char> bytes(const ModeOutcome& m) {
  ByteWriter out;
  out.add(m.pose, m.hypothesis, m.iterations, m.information, m.source_moments, m.target_moments);
  add(out, m.matches);
  add(out, m.source);
  add(out, m.target);
  return out.all;
}

/// Everything of a pair of RegistrationMethod::compatibility but the timings.
inline std::vector<char> bytes(const PairOutcome& o) {
  ByteWriter out;
  const RegistrationStatistics& s = o.statistics;
  out.add(o.match_weight_source, o.match_weight_target, s.source_points, s.target_points,
          s.correspondences, s.hypotheses, s.survivors, s.scored);
  out.add(o.modes.size());
  for (const ModeOutcome& mode : o.modes) {
    const std::vector<char> one = bytes(mode);
    out.all.insert(out.all.end(), one.begin(), one.end());
  }
  return out.all;
}

}  // namespace gpureg::test
