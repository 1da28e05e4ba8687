// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "fields/field.hpp"
#include "gpureg/loop_consistency.hpp"

namespace gpureg::fields {

template <>
struct Fields<LoopConsistencyOptions> {
  static constexpr const char* kName = "LoopConsistencyOptions";
  static constexpr const char* kGroup = "";
  static constexpr const char* kSentence = "Model of closing errors.";

  // clang-format off: a field is a line.
  template <typename V>
  static void visit(V&& v) {
    using O = LoopConsistencyOptions;
    v(&O::voxel_size, {"voxel_size", kLength, "Of the clouds."});
    v(&O::closing_angle, {"closing_angle", kDegrees, "Standard deviation of the rotation error of a loop of three correct poses."});
    v(&O::closing_distance, {"closing_distance", above(0, kMost, "a number of voxels > 0").in_voxels(), "Standard deviation of its translation error."});
    v(&O::false_closure_rate, {"false_closure_rate", kOpenProbability, "Probability that a loop with a false pose closes all the same."});
    v(&O::missed_closure_rate, {"missed_closure_rate", kOpenProbability, "Probability that a loop of three correct poses does not close."});
    v(&O::max_odds_factor, {"max_odds_factor", from(1, kMost, "a factor of at least 1"), "Largest factor by which all loops together change the odds of a pose."});
    v(&O::min_confidence, {"min_confidence", kProbability, "Pairs below take no part and keep their confidence."});
    v(&O::min_alternative_confidence, {"min_alternative_confidence", kProbability, "Confidence from which a mode that is not the first takes part."});
    v(&O::modes, {"modes", from(1, 16), "Number of modes of a pair that take part."});
    v(&O::neighbors, {"neighbors", from(2, 1024), "Number of pairs of a cloud that form loops, the most confident ones."});
    v(&O::iterations, {"iterations", from(1, 100), "Damped updates."});
    v(&O::threads, {"threads", from(0, kInfinity), "0: one per core. Results do not depend on it."});
  }
  // clang-format on
};

template <>
struct Fields<PairConsistency> {
  static constexpr const char* kName = "PairConsistency";
  static constexpr const char* kSentence = "Confidence of one pair in view of the others.";

  // clang-format off: a field is a line.
  template <typename V>
  static void visit(V&& v) {
    using P = PairConsistency;
    v(&P::confidence, {"confidence", "Probability that the mode is correct, given all pairs."});
    v(&P::mode, {"mode", "Index into RegistrationResult.modes; 0, target_from_source, if there are none."});
    v(&P::loops, {"loops", "Loops of three that the pair is in."});
    v(&P::path, {"path", "Number of pairs on the most confident path that the pair was compared with; 0: none. Without loops and path the confidence is that of the result."});
  }
  // clang-format on
};

}  // namespace gpureg::fields
