// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <memory>

#include "data/ground_truth.hpp"
#include "data/rooms/house.hpp"
#include "data/sensor/ray_scene.hpp"

namespace gpureg::bench {

using Cameras = std::vector<Eigen::Isometry3d>;

/// A house and what a camera sees of it.
class TrueHouse {
 public:
  explicit TrueHouse(synthetic::House house);

  /// A surface within 3 cm, one within 7.5 cm, or none.
  enum class Surface { here, near, none };
  Surface surface_at(const Eigen::Vector3f& p) const;

  /// One of the cameras (world_from_camera) saw a surface at least 10 cm behind the location, and
  /// nothing before it. recorded: the points that became of it.
  bool seen_through(const Eigen::Vector3f& p, const Cameras& cameras,
                    const synthetic::NeighbourGrid& recorded) const;

 private:
  synthetic::House house_;
  synthetic::RayScene scene_;
  std::unique_ptr<synthetic::NeighbourGrid> here_, near_;
};

}  // namespace gpureg::bench
