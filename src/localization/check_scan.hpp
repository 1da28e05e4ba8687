// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>

#include "localization/map_state.hpp"

namespace gpureg::localization {

/// Throws InvalidArgument where the points of a scan are so far apart, or so close together, for
/// the voxels of the map that the two must be in different units; says which units it looks like.
void check_unit(const PointCloudView& scan, const MapState& map, const std::string& name);

/// Throws InvalidArgument for a scan, or a map, of a 2-D scanner: places need all three dimensions.
void refuse_flat(const PointCloudView& cloud, const std::string& name);

/// check_unit() of the points of a map, before its tiles are made.
void check_map(const PointCloud& cloud, const MapSettings& options);

}  // namespace gpureg::localization
