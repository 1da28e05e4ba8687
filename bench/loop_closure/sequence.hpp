// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "gpureg/registration.hpp"

/// Sequences of fragments whose pairs were registered once, with simulated odometry.
namespace gpureg::bench {

struct RegisteredPair {
  int source = 0, target = 0;
  double overlap = 0;  ///< of the best mode, the larger side
  RegistrationResult result;
};

struct Sequence {
  std::vector<UnalignedIsometry3d> truth;  ///< world_from_fragment
  std::vector<RegisteredPair> pairs;
  /// The earliest revisit: a pair that overlaps, after the sensor has left.
  int revisit_source = 0, revisit_target = 0;
};

/// Reads what run.py writes. Throws std::runtime_error.
Sequence read_sequence(const std::string& path);

/// Simulated odometry.
struct SimulatedOdometry {
  std::vector<UnalignedIsometry3d> poses;  ///< world_from_fragment
  double per_metre = 0;  ///< metres of error per metre travelled; degrees of yaw: ten times
};

/// Odometry whose first revisit is off by `metres`: a bias of yaw and scale, and noise of half the
/// size, both drawn by the seed. Of several draws the one of median size.
SimulatedOdometry drifted(const Sequence& sequence, double metres, std::uint64_t seed);

/// Odometry of independent errors: RMS `share` of each step's length, and `degrees`.
std::vector<UnalignedIsometry3d> noisy(const Sequence& sequence, double share, double degrees,
                                       std::uint64_t seed);

bool correct(const UnalignedIsometry3d& truth, const UnalignedIsometry3d& pose);

/// A loop for verification.
struct Trial {
  int source = 0, target = 0;
  bool is_true = false;
  double overlap = 0;
  RegistrationResult result;  ///< one mode
};

/// At most `most` true loops, and wrong poses that align() returned, so that `false_share` of all
/// are false; none where the sequence has too few wrong poses. shuffled: wrong poses get the
/// confidences of true ones, so that only geometry tells.
std::vector<Trial> trials(const Sequence& sequence, std::size_t most, double false_share,
                          bool shuffled, std::uint64_t seed);

/// RMS distance of positions after the best rigid alignment, metres.
double rmse(const std::vector<UnalignedIsometry3d>& truth,
            const std::vector<UnalignedIsometry3d>& poses);

}  // namespace gpureg::bench
