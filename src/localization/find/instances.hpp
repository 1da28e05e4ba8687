// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "localization/find/part_evidence.hpp"
#include "symmetry/symmetry.hpp"

namespace gpureg::localization {

/// A pose that may be one of an instance.
struct Hypothesis {
  RowPose pose = RowPose::Identity();
  std::uint32_t votes = 1;
  PartVerifier::Verdict verdict;
  double log_odds = 0;
  std::uint32_t equivalent = 0;  ///< poses that a symmetry makes equal
};

/// Sets verdicts and log odds, and sorts by them.
void judge(const PartVerifier& verifier, unsigned threads, std::vector<Hypothesis>& all);

/// Leaves the first one of poses within a distance of each other, with the votes of all.
std::vector<Hypothesis> distinct(const PartVerifier& verifier, std::vector<Hypothesis> all,
                                 double distance);

/// Non-maximum suppression of judged hypotheses: none shares much of the scene's surface with a
/// better one, which learns of its rivals.
std::vector<Hypothesis> instances_of(const PartVerifier& verifier, CloudSymmetry& symmetry,
                                     double diameter, std::vector<Hypothesis> all);

}  // namespace gpureg::localization
