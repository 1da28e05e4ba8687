// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <optional>
#include <vector>

#include "gpureg/reconstruction.hpp"

namespace gpureg::reconstruction {

/// Agreement::jumps of a map.
/// @param sensors where the sensor of each scan was, in its frame, metres.
/// @param pairs, results what the map was made of.
double jumps_along_the_path(const Reconstruction& map, const std::vector<Eigen::Vector3d>& sensors,
                            const std::vector<Pair>& pairs,
                            const std::vector<RegistrationResult>& results);

/// The pairs that are trusted where places look alike. Scans are numbered along the path of the
/// sensor: pairs of scans that follow each other overlap far more often than others, and no two of
/// them are far apart. Islands of such pairs grow by other pairs only where that stays true.
/// @param sensors as above.
/// @return one per pair; none where the numbers of the scans say nothing.
std::optional<std::vector<char>> pairs_along_the_path(
    const std::vector<Eigen::Vector3d>& sensors, const std::vector<Pair>& pairs,
    const std::vector<RegistrationResult>& results, const Options& options);

}  // namespace gpureg::reconstruction
