// SPDX-License-Identifier: BSD-3-Clause
#include "fields/reconstruction.hpp"
#include "fields/scale.hpp"
#include "fields/validate.hpp"

namespace gpureg::reconstruction {
namespace {

/// Depth cameras: beyond, their noise grows with the square of the range.
constexpr float kNoiseRangeVoxels = 30;

template <typename T>
T scaled(float voxel_size) {
  require(gpureg::positive(voxel_size), "voxel_size", voxel_size, "a finite number > 0");
  T options;
  fields::scale(options, voxel_size);
  return options;
}

}  // namespace

void EdgeNoiseOptions::validate() const {
  fields::validate(*this);
  require(max_translation >= translation, "noise.max_translation", max_translation,
          "a finite number >= noise.translation");
}

Options Options::from_voxel_size(float voxel_size) { return scaled<Options>(voxel_size); }
void Options::validate() const { fields::validate(*this); }

RefineOptions RefineOptions::from_voxel_size(float voxel_size) {
  return scaled<RefineOptions>(voxel_size);
}

RefineOptions RefineOptions::for_depth_cameras(float voxel_size) {
  RefineOptions options = from_voxel_size(voxel_size);
  options.noise_range = static_cast<double>(kNoiseRangeVoxels * voxel_size);
  return options;
}

void RefineOptions::validate() const {
  fields::validate(*this);
  require(final_distance <= initial_distance, "final_distance", final_distance,
          "a finite number > 0 and <= initial_distance");
}

}  // namespace gpureg::reconstruction
