// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "fields/field.hpp"

namespace gpureg::fields {

/// The voxel size that the defaults are for.
constexpr double kDefaultVoxel = 0.05;

/// Calls of_float(value, field) and of_double(value, field) for the lengths of `options`, and of
/// its groups.
template <typename T, typename OfFloat, typename OfDouble>
void for_each_length(T& options, const OfFloat& of_float, const OfDouble& of_double) {
  each<T>([&](const std::string&, auto member, const Field& field) {
    auto& value = options.*member;
    using M = std::decay_t<decltype(value)>;
    if constexpr (is_described<M>)
      for_each_length(value, of_float, of_double);
    else if constexpr (std::is_same_v<M, float>) {
      if (field.scale.factor != 0) of_float(value, field);
    } else if constexpr (std::is_same_v<M, double>) {
      if (field.scale.proportional) of_double(value, field);
    }
  });
}

/// Sets every length of `options`, and of its groups, from the voxel size. Lengths in proportion
/// are multiplied, so that they have to be those of kDefaultVoxel.
template <typename T>
void scale(T& options, float voxel_size) {
  for_each_length(
      options,
      [&](float& value, const Field& field) {
        // In this order 2.4 voxels are exactly the default at 0.05.
        value = voxel_size / field.scale.divisor * field.scale.factor;
      },
      [&](double& value, const Field&) {
        value *= static_cast<double>(voxel_size) / kDefaultVoxel;
      });
}

/// Multiplies every length of `options`, and of its groups.
template <typename T>
void multiply_lengths(T& options, double factor) {
  for_each_length(
      options, [&](float& value, const Field&) { value *= static_cast<float>(factor); },
      [&](double& value, const Field&) { value *= factor; });
}

}  // namespace gpureg::fields
