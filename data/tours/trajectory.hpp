// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Geometry>
#include <cstdint>
#include <vector>

#include "data/rooms/house.hpp"
#include "data/sensor/ray_scene.hpp"

namespace gpureg::synthetic {

/// A hand-held camera that is carried through the rooms, comes back to them, and looks around:
/// world_from_camera per frame (x right, y down, z forward). The first frames of a long walk are
/// those of a short one. no_return: as for tour(). scene: the house's mesh, to look at.
std::vector<Eigen::Isometry3d> walk(const House& house, const RayScene& scene, std::uint64_t seed,
                                    int frames, float no_return = 0);

}  // namespace gpureg::synthetic
