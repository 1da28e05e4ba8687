// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <vector>

#include "data/rooms/house.hpp"
#include "data/sensor/ray_scene.hpp"

namespace gpureg::synthetic {

constexpr float kTourSpacing = 0.02f;  ///< metres between the points of a tour

/// Walk of a given length (metres) that observes everything and returns: from
/// room to room, or, in a building that was read from a file, from place to place. A long tour
/// begins with the short one. scene: the house's mesh. no_return, metres: the walk does not come
/// back (first_return) before that length. Throws InvalidArgument when there is no place to walk,
/// and when no walk of this building stays away for no_return.
std::vector<Eigen::Vector2f> tour(const House& house, const RayScene& scene, std::uint64_t seed,
                                  float length, float no_return = 0);

/// Length of the walk, metres, at which it is for the first time within 1.2 m of a place that it
/// left at least 6 m earlier; the whole length where it never is.
float first_return(const std::vector<Eigen::Vector2f>& tour);

}  // namespace gpureg::synthetic
