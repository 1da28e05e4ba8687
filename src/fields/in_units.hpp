// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "fields/field.hpp"

/// From numbers of voxels to lengths in the unit of the points.
namespace gpureg::fields {

/// A number of voxels as a length. In this order lengths are exactly those that the records were
/// made with: 0.6 voxels of 0.05 are 0.03.
inline double length_of(double voxels, float voxel_size) {
  return voxels / 20 * (static_cast<double>(voxel_size) / 0.05);
}

/// The options with every length in the unit of the points, in their groups, too.
template <typename T>
T in_units(T options, float voxel_size) {
  each<T>([&](const std::string&, auto member, const Field& field) {
    auto& value = options.*member;
    using M = std::decay_t<decltype(value)>;
    if constexpr (is_described<M>)
      value = in_units(value, voxel_size);
    else if constexpr (std::is_same_v<M, float>) {
      if (field.range.voxels) value *= voxel_size;
    } else if constexpr (std::is_same_v<M, double>) {
      if (field.range.voxels) value = length_of(value, voxel_size);
    }
  });
  return options;
}

}  // namespace gpureg::fields
