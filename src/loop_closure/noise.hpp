// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <vector>

#include "loop_closure/paths.hpp"
#include "loop_closure/state.hpp"

namespace gpureg::loop_closure {

/// Factors on stated standard deviations.
struct NoiseScales {
  double rotation = 1, translation = 1;            ///< of modelled odometry
  double loop_rotation = 1, loop_translation = 1;  ///< of the modes of loops
};

/// What the misclosures of accepted loops show of the noise: most likely variance components, by
/// minorisation-maximisation (Zhou, Hu, Qiao and Zhou 2019), with a wide prior about the stated
/// noise. A misclosure is the difference between a loop and the odometry between its ends; loops
/// are taken as independent of each other.
/// @param drift_scale on the stated noise of modelled odometry.
NoiseScales estimate_noise(const State& state, const Paths& odometry, double drift_scale);

/// The information of an edge with scaled standard deviations of rotation and translation, times
/// `weight`. Within what pose graphs take.
UnalignedMatrix6d scaled_information(const UnalignedMatrix6d& information, double rotation,
                                     double translation, double weight);

}  // namespace gpureg::loop_closure
