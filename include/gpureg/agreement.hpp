// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <vector>

#include "gpureg/registration.hpp"

/// Agreement among the pairs of one set of clouds: poses around a loop must lead back to where it
/// began.
namespace gpureg {

/// How loops are judged. The defaults are for voxels of 5 cm; the tolerances grow with the voxel.
struct AgreementOptions {
  float closing_angle = 3.0f;  ///< degrees, and ...
  /// ... metres by which three right poses typically miss their beginning (one standard deviation)
  float closing_distance = 0.15f;
  /// how often a loop with a wrong pose closes all the same: near misses, and places that look
  /// alike, whose wrong poses close their loops with right ones (0 to 0.33 of them in seven scenes,
  /// and loops share pairs)
  double chance = 0.4;
  double miss = 0.02;  ///< how often a loop of three right poses does not close
  /// by which all loops together may raise or lower the odds of a pose; loops are not independent
  double max_factor = 55.0;
  double min_confidence = 0.02;  ///< pairs below take no part and keep their confidence
  double min_rival = 0.002;      ///< confidence from which a mode that is not the first takes part
  std::uint32_t modes = 4;       ///< of a pair, the first so many take part, 1..16
  /// of a cloud, so many pairs, the most confident, judge others, 2..1024: cost grows with pairs
  /// times this
  std::uint32_t neighbors = 64;
  std::uint32_t rounds = 3;  ///< damped updates, 1..100

  /// The distance is three voxels; the rest does not depend on the voxel. Throws InvalidArgument
  /// unless v is finite and > 0.
  static AgreementOptions from_voxel_size(float voxel_size);

  /// Throws InvalidArgument naming field and value.
  void validate() const;
};

/// What the other pairs say of one pair.
struct PairAgreement {
  double confidence = 0;  ///< probability that the mode is right, given all pairs
  std::uint32_t mode =
      0;  ///< index into RegistrationResult::modes; 0 where there are none: target_from_source
  std::uint32_t loops = 0;  ///< of three that were looked at
  /// pairs on the trusted path that it was compared with; 0: there is none, or it is on such paths
  /// itself. Without loops or a path the confidence is the result's own score
  std::uint32_t path = 0;
};

/// Confidences of pairs in view of each other: results[k] belongs to pairs[k], as align_batch gives
/// them. In a loop of three clouds the composition of right poses is the identity; that of others
/// is by chance. Each mode of a pair is judged by the loops that it forms with modes of other
/// pairs, weighed by how likely those are right, and beliefs are updated in a few damped rounds. A
/// pair whose other mode the loops support comes back with that mode. Then the most trusted pairs
/// that connect all clouds are taken as they are, and every other pair is compared with the path
/// that they make between its clouds: places that look alike agree with each other in loops of
/// three, but not with the way from one to the other. Results without modes
/// (Proposal::quadruples) take part with their pose and score.
///
/// Distances are measured at the clouds' centres, known from the results' moments (results made by
/// hand without any: at the origin). Deterministic; independent of the order of the pairs. Pairs of
/// a cloud with itself, and those never tried, are left as they are. Throws InvalidArgument naming
/// the entry for different lengths, scores and confidences outside [0, 1], and poses that are no
/// rigid motions. Thread-safe.
std::vector<PairAgreement> agreement(const std::vector<Pair>& pairs,
                                     const std::vector<RegistrationResult>& results,
                                     const AgreementOptions& options = {});

}  // namespace gpureg
