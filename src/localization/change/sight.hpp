// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "localization/surface.hpp"

namespace gpureg::localization {

/// What the sensor positions of a surface tell of a location.
struct Sight {
  float gap = 0;  ///< largest distance before the planes of all surfaces that were seen behind it
  std::uint16_t free = 0;     ///< positions that saw through it
  std::uint16_t surface = 0;  ///< positions that saw a surface there
  std::uint16_t blocked = 0;  ///< positions that saw a surface before it

  std::size_t known() const { return std::size_t{free} + surface + blocked; }
  void add(const Sight& other);  ///< in any order the same
};

/// Depth maps of several resolutions around one sensor position, with the disc that was seen in
/// each cell.
class DepthPyramid {
 public:
  DepthPyramid();
  /// number: of the viewpoint.
  void render(const Surface& surface, std::size_t number);
  /// tolerance: distance from a plane up to which a location is on it.
  Sight at(const Eigen::Vector3f& p, float tolerance) const;

 private:
  struct Level {
    int edge;  ///< cells along an edge of a face of the cube
    std::vector<float> range;
    std::vector<std::uint32_t> disc;
  };
  void splat(Level& level, std::uint32_t disc, float range);

  const Surface* surface_ = nullptr;
  Eigen::Vector3f viewpoint_{0, 0, 0};
  const Horizon* horizon_ = nullptr;
  std::vector<Level> levels_;
};

/// Sight of each location by the surface's viewpoints; tolerances: one per location, 0 where
/// nobody asks.
std::vector<Sight> sights(const Surface& surface, const std::vector<Eigen::Vector3f>& locations,
                          const std::vector<float>& tolerances, unsigned threads);

}  // namespace gpureg::localization
