// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "localization/map_state.hpp"

namespace gpureg::localization {

/// A unit normal, or zero.
Side side_of(const Eigen::Vector3f& normal);

/// Normals of a tile's points, of either side; zero: not known.
std::vector<Eigen::Vector3f> tile_normals(const Context& context, const MapState& map,
                                          std::size_t tile);

/// Infers the sides of the surfaces of a map that came without any, tile by tile, where they are
/// clear: a sensor sees most of its surroundings before the surfaces that it sees, and hardly
/// anything behind them. An alignment with a tile of unknown sides tries both, which takes twice
/// the time, and its preparation three times that.
void infer_sides(const Context& context, MapState& map);

}  // namespace gpureg::localization
