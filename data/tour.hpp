// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <vector>

#include "data/house.hpp"
#include "data/ray_scene.hpp"

namespace gpureg::synthetic {

constexpr float kTourSpacing = 0.02f;  ///< metres between the points of a tour

/// Walk of a given length (metres) that observes everything and returns: from
/// room to room, or, in a building that was read from a file, from place to place. A long tour
/// begins with the short one. scene: the house's mesh. Throws InvalidArgument when there is no
/// place to walk.
std::vector<Eigen::Vector2f> tour(const House& house, const RayScene& scene, std::uint64_t seed,
                                  float length);

}  // namespace gpureg::synthetic
