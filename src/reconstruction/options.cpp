// SPDX-License-Identifier: BSD-3-Clause
#include "fields/reconstruction.hpp"
#include "fields/validate.hpp"

namespace gpureg::reconstruction {
void EdgeNoiseOptions::validate() const {
  fields::validate(*this);
  require(max_translation >= translation, "noise.max_translation", max_translation,
          "a finite number >= noise.translation");
}

void Options::validate() const { fields::validate(*this); }

RefineOptions RefineOptions::for_depth_cameras(float voxel_size) {
  RefineOptions options{voxel_size};
  // Beyond, the noise of depth cameras grows with the square of the range.
  options.noise_range = 30;
  return options;
}

void RefineOptions::validate() const {
  fields::validate(*this);
  require(final_distance <= initial_distance, "final_distance", final_distance,
          "a finite number > 0 and <= initial_distance");
}

}  // namespace gpureg::reconstruction
