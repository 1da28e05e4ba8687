// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "fields/field.hpp"

namespace gpureg::fields {

/// The voxel size that the defaults are for.
constexpr double kDefaultVoxel = 0.05;

/// Sets every length of `options`, and of its groups, from the voxel size. Lengths in proportion
/// are multiplied, so that they have to be those of kDefaultVoxel.
template <typename T>
void scale(T& options, float voxel_size) {
  each<T>([&](const std::string&, auto member, const Field& field) {
    auto& value = options.*member;
    using M = std::decay_t<decltype(value)>;
    if constexpr (is_described<M>)
      scale(value, voxel_size);
    else if constexpr (std::is_same_v<M, float>) {
      // In this order 2.4 voxels are exactly the default at 0.05.
      if (field.scale.factor != 0) value = voxel_size / field.scale.divisor * field.scale.factor;
    } else if constexpr (std::is_same_v<M, double>) {
      if (field.scale.proportional) value *= static_cast<double>(voxel_size) / kDefaultVoxel;
    }
  });
}

/// Multiplies every length of `options`, and of its groups.
template <typename T>
void multiply_lengths(T& options, double factor) {
  each<T>([&](const std::string&, auto member, const Field& field) {
    auto& value = options.*member;
    using M = std::decay_t<decltype(value)>;
    if constexpr (is_described<M>)
      multiply_lengths(value, factor);
    else if constexpr (std::is_same_v<M, float>) {
      if (field.scale.factor != 0) value *= static_cast<float>(factor);
    } else if constexpr (std::is_same_v<M, double>) {
      if (field.scale.proportional) value *= factor;
    }
  });
}

}  // namespace gpureg::fields
