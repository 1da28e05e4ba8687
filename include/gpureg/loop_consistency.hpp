// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <vector>

#include "gpureg/registration.hpp"

/// Loop consistency among the pairs of one set of clouds: correct poses around a loop of clouds
/// compose to the identity.
namespace gpureg {

/// Model of closing errors.
struct LoopConsistencyOptions {
  float voxel_size = 0.05f;  ///< of the clouds, in the unit of the points
  /// Standard deviation of the rotation error of a loop of three correct poses, degrees.
  float closing_angle = 3.0f;
  float closing_distance = 3;  ///< standard deviation of its translation error, voxels
  /// Probability that a loop with a false pose closes all the same: near misses, and perceptual
  /// aliases, whose false poses close loops with correct ones. Measured: 0 to 0.33 in seven scenes;
  /// loops also share pairs.
  double false_closure_rate = 0.4;
  /// Probability that a loop of three correct poses does not close.
  double missed_closure_rate = 0.02;
  /// Largest factor by which all loops together change the odds of a pose: loops are not
  /// independent.
  double max_odds_factor = 55.0;
  double min_confidence = 0.02;  ///< pairs below take no part and keep their confidence
  /// Confidence from which a mode that is not the first takes part.
  double min_alternative_confidence = 0.002;
  std::uint32_t modes = 4;  ///< number of modes of a pair that take part, 1..16
  /// Number of pairs of a cloud that form loops, the most confident ones, 2..1024. The cost grows
  /// with the number of pairs times this.
  std::uint32_t neighbors = 64;
  std::uint32_t iterations = 3;  ///< damped updates, 1..100
  int threads = 0;               ///< 0: one per core. Results do not depend on it.

  /// @throws InvalidArgument naming field and value.
  void validate() const;
};

/// Confidence of one pair in view of the others.
struct PairConsistency {
  double confidence = 0;  ///< probability that the mode is correct, given all pairs
  /// Index into RegistrationResult::modes; 0, target_from_source, if there are none.
  std::uint32_t mode = 0;
  std::uint32_t loops = 0;  ///< loops of three that the pair is in
  /// Number of pairs on the most confident path that it was compared with; 0: no such path, or the
  /// pair belongs to these paths. Without loops and path the confidence is that of the result.
  std::uint32_t path = 0;
};

/// Re-scores every pair by loops of three clouds, and then by the most confident path between its
/// clouds, which rejects perceptual aliases.
///
/// Loops: the odds of each mode change by how well it closes loops with modes of other pairs, each
/// weighted by its probability, in a few damped iterations. A pair whose other mode closes the
/// loops comes back with that mode. Paths: the most confident pairs that connect all clouds (a
/// maximum spanning forest) keep their probability; every other pair is compared with the path that
/// they form between its clouds. Perceptual aliases agree with each other in loops of three, but
/// not with the path from one place to the other. Results without modes
/// (RegistrationMethod::quadruples) take part with their pose and confidence.
///
/// Closing errors are measured at the centres of the clouds, known from the results' moments (of
/// results without moments: at the origin). Deterministic and independent of the order of the
/// pairs. Pairs of a cloud with itself and pairs that were never tried keep their confidence.
/// Thread-safe.
///
/// @param pairs indices of clouds, as for align_batch().
/// @param results results[k] belongs to pairs[k], as align_batch() returns them.
/// @return one entry for each pair.
/// @throws InvalidArgument naming the entry: different lengths, scores and confidences outside
///   [0, 1], poses that are no rigid motions.
std::vector<PairConsistency> loop_consistency(const std::vector<Pair>& pairs,
                                              const std::vector<RegistrationResult>& results,
                                              const LoopConsistencyOptions& options = {});

}  // namespace gpureg
