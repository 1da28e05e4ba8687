// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <vector>

#include "gpureg/reconstruction.hpp"

namespace gpureg::reconstruction {

/// Closest points of a surface within a fixed distance: a hash of cells of that size.
class SurfaceGrid {
 public:
  static constexpr std::uint32_t kNone = 0xffffffffu;

  /// Takes the points with a finite position and a normal. The surface must outlive the grid.
  SurfaceGrid(const Surface& surface, float distance);

  /// Whether a point may have a neighbour: it lies in the box of the surface, enlarged by the
  /// distance.
  bool may_reach(const Eigen::Vector3f& p) const {
    return (p.array() >= low_.array()).all() && (p.array() <= high_.array()).all();
  }

  /// @return index of the closest point within the distance whose normal makes a cosine of at least
  ///   min_cosine with the normal, the lower index of equally close ones; kNone without one.
  std::uint32_t closest(const Eigen::Vector3f& p, const Eigen::Vector3f& normal,
                        float min_cosine) const;

 private:
  struct Cell {
    std::uint64_t key = kEmpty;
    std::uint32_t begin = 0, end = 0;  ///< into indices_
  };
  static constexpr std::uint64_t kEmpty = ~std::uint64_t{0};

  std::uint64_t key_of(const Eigen::Vector3i& cell) const;
  Eigen::Vector3i cell_of(const Eigen::Vector3f& p) const;
  const Cell* find(std::uint64_t key) const;

  const Surface& surface_;
  float distance_;
  Eigen::Vector3f low_, high_;
  std::vector<std::uint32_t> indices_;  ///< by cell, ascending within each
  std::vector<Cell> cells_;             ///< open addressing; the size is a power of two
};

}  // namespace gpureg::reconstruction
