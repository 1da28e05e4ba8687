// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Geometry>
#include <cstdint>
#include <vector>

#include "data/house.hpp"
#include "data/ray_scene.hpp"

namespace gpureg::synthetic {

/// Where a person can walk: cells of 10 cm with the cost of a step, high near walls and furniture.
class WalkMap {
 public:
  explicit WalkMap(const House& house);

  /// Half a metre from walls and tall furniture, and not in other furniture.
  bool free(const Eigen::Vector2f& p) const;
  /// From the first to the last point through walkable cells; empty where there is no way.
  std::vector<Eigen::Vector2f> path(const Eigen::Vector2f& from, const Eigen::Vector2f& to) const;

 private:
  static constexpr float kCell = 0.1f;
  int cell_of(const Eigen::Vector2f& p) const;  // -1 outside
  Eigen::Vector2f centre(int cell) const;

  Eigen::Vector2f origin_;
  int columns_ = 0, rows_ = 0;
  std::vector<float> cost_;  // 0: blocked
};

/// A hand-held camera that is carried through the rooms, comes back to them, and looks around:
/// world_from_camera per frame (x right, y down, z forward). The first frames of a long walk are
/// those of a short one. scene: the house's mesh, to look at.
std::vector<Eigen::Isometry3d> walk(const House& house, const RayScene& scene, std::uint64_t seed,
                                    int frames);

}  // namespace gpureg::synthetic
