// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <vector>

#include "gpureg/reconstruction.hpp"

namespace gpureg::reconstruction {

/// Whether more confident pairs contradict the map than their confidences explain, by two standard
/// deviations, or else by any number while scans of consecutive numbers lie farther apart than
/// others: places of this building look alike, and pairs that agree may be wrong together.
/// @param sensors where the sensor of each scan was, in its frame, metres.
bool places_look_alike(const Reconstruction& map, const std::vector<Eigen::Vector3d>& sensors);

/// The pairs that are trusted where places look alike. Scans are numbered along the path of the
/// sensor: pairs of scans that follow each other overlap far more often than others, and no two of
/// them are far apart. Islands of such pairs grow by other pairs only where that stays true.
/// @param sensors as above.
/// @return one per pair; all where the numbers of the scans say nothing.
std::vector<char> pairs_along_the_path(const std::vector<Eigen::Vector3d>& sensors,
                                       const std::vector<Pair>& pairs,
                                       const std::vector<RegistrationResult>& results,
                                       const Options& options);

}  // namespace gpureg::reconstruction
