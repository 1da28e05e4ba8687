// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <cstddef>

#include "gpureg/localization/find.hpp"

namespace gpureg::localization {

/// What the confidence of a part is a function of.
enum class PartFeature : std::size_t {
  supported,
  violated,
  occluded,
  contour,
  contour_length,
  log_area,
  residual,
  log_weakest,
  log_third_weakest,
  log_votes,
  rival,
  count
};
constexpr std::size_t kPartFeatures = static_cast<std::size_t>(PartFeature::count);

/// A share counts as the lower bound that its number of pixels allows: no certainty without
/// evidence.
std::array<double, kPartFeatures> part_features(const PartEvidence& evidence);

/// Logarithm of the odds that the pose is correct; monotone in every feature.
double part_log_odds(const PartEvidence& evidence);
double part_confidence(const PartEvidence& evidence);

}  // namespace gpureg::localization
