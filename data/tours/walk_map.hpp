// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <vector>

#include "data/rooms/house.hpp"
#include "data/sensor/ray_scene.hpp"

namespace gpureg::synthetic {

/// Where a person can walk: cells of 10 cm with the cost of a step, high near walls and furniture.
class WalkMap {
 public:
  static constexpr float kCell = 0.1f;      ///< metres
  static constexpr float kHeadroom = 1.9f;  ///< metres of headroom, in a building from a file

  explicit WalkMap(const House& house);
  /// Of a mesh of which nothing is known: z up, floor at z = 0. The largest connected area that is
  /// walled in. Throws InvalidArgument when there is none, or when the mesh is larger than 150 m.
  explicit WalkMap(const RayScene& scene);

  /// Half a metre from walls and tall furniture, and not in other furniture.
  bool free(const Eigen::Vector2f& p) const;
  /// Perhaps near a wall or in low furniture.
  bool walkable(const Eigen::Vector2f& p) const;
  /// The centres of all free cells.
  std::vector<Eigen::Vector2f> free_places() const;
  /// From the first to the last point through walkable cells; empty where there is no way.
  std::vector<Eigen::Vector2f> path(const Eigen::Vector2f& from, const Eigen::Vector2f& to) const;

 private:
  void lay_out(const Eigen::Vector2f& low, const Eigen::Vector2f& high);
  /// Costs per cell from solid cells (walls, tall furniture) and low furniture.
  void price(const std::vector<std::uint8_t>& solid,
             const std::vector<std::uint8_t>& low_furniture);
  void keep_largest_area();
  int cell_of(const Eigen::Vector2f& p) const;  // -1 outside
  Eigen::Vector2f centre(int cell) const;

  Eigen::Vector2f origin_;
  int columns_ = 0, rows_ = 0;
  std::vector<float> cost_;  // 0: blocked
};

}  // namespace gpureg::synthetic
