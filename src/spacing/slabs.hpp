// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <map>
#include <memory>
#include <vector>

#include "math/vec3.hpp"
#include "pipeline/types.hpp"

namespace gpureg {

/// The rows of a slab with very many of them, as of a wall across x: each place once, sorted along
/// the axis of the largest spread.
class CrowdedSlab {
 public:
  explicit CrowdedSlab(std::vector<Eigen::Vector3f> rows);
  /// The lesser of `nearest` and the squared distance from p to the nearest row at another place.
  float nearest_squared(Vec3 p, float nearest) const;

 private:
  Eigen::Index axis_;
  std::vector<Eigen::Vector3f> rows_;
};

/// The finite rows of a cloud in slabs of equal width along x, in no order within a slab. Takes a
/// small part of the time of a sort.
class Slabs {
 public:
  explicit Slabs(const RawCloud& rows);

  struct Row {
    Vec3 position;
    std::size_t slab;
  };
  /// The rows at `most` evenly spaced places in the order of x, y, z, or all. Does not depend on
  /// the order of the input.
  std::vector<Row> evenly_spaced(std::size_t most) const;
  /// Squared distance from a row to the nearest row at another place; infinite where there is none.
  float nearest_squared(const Row& row) const;

 private:
  std::size_t size() const { return begin_.back(); }
  Vec3 row_of(std::size_t slab, const std::vector<std::uint64_t>& keys, std::size_t place) const;
  std::size_t slabs() const { return begin_.size() - 1; }
  bool is_crowded(std::size_t slab) const;
  std::vector<Eigen::Vector3f> rows_of(std::size_t slab) const;
  float nearest_of(std::size_t begin, std::size_t end, Vec3 position, float nearest) const;

  std::vector<std::uint32_t> begin_;  ///< of each slab, and the end
  std::unique_ptr<float[]> values_;   ///< all x, all y, all z, with a whole group of infinite rows
  std::map<std::size_t, CrowdedSlab> crowded_;
  const float *x_ = nullptr, *y_ = nullptr, *z_ = nullptr;
};

}  // namespace gpureg
