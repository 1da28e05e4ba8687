// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <algorithm>

namespace gpureg::scale {

/// A scale that refinement changes by less is not prepared again.
constexpr double kSettled = 0.002;
/// Largest change that refinement may make: beyond, it has lost the pose. From a sixth off it still
/// finds the scale.
constexpr double kMostChange = 0.3;
/// Refinements of a scale, each with the source prepared at the last one.
constexpr int kRounds = 3;
/// Scales whose difference is no ambiguity.
constexpr double kSameScale = 0.03;
/// Standard deviation of the scale of a pair beyond that of its points, whose errors are not
/// independent: depth cameras have 1.5 % between two scans of one room (docs/scale.md), of which
/// each scan has its share.
constexpr double kOwnScale = 0.01;
/// RefinedScale::stiffness below which the scale is not observable.
constexpr double kLeastStiffness = 0.1;
/// Correspondences of the refinement of the scale, in correspondence distances: it starts a few per
/// cent off.
constexpr float kReach = 2;
/// The same for the source, whose scale may be smaller than that of its points.
constexpr float kReachOfSource = 1.5f * kReach;

inline double odds_of(double confidence) { return confidence / std::max(1e-9, 1 - confidence); }

}  // namespace gpureg::scale
