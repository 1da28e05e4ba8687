// SPDX-License-Identifier: BSD-3-Clause
#include <cmath>

#include "common/validate.hpp"
#include "gpureg/reconstruction.hpp"

namespace gpureg::reconstruction {
namespace {

bool positive(double v) { return std::isfinite(v) && v > 0; }
bool probability(double v) { return v > 0 && v <= 1; }

/// The voxel size that the defaults are for.
constexpr double kDefaultVoxel = 0.05;
/// Depth cameras: beyond, their noise grows with the square of the range.
constexpr float kNoiseRangeVoxels = 30;

double scale_of(float voxel_size) {
  require(gpureg::positive(voxel_size), "voxel_size", voxel_size, "a finite number > 0");
  return static_cast<double>(voxel_size) / kDefaultVoxel;
}

}  // namespace

void EdgeNoiseOptions::validate() const {
  require(positive(translation), "noise.translation", translation, "a finite number > 0");
  require(positive(rotation) && rotation <= 180, "noise.rotation", rotation, "(0, 180]");
  require(std::isfinite(max_translation) && max_translation >= translation, "noise.max_translation",
          max_translation, "a finite number >= noise.translation");
}

Options Options::from_voxel_size(float voxel_size) {
  const double scale = scale_of(voxel_size);
  Options options;
  options.consistency = LoopConsistencyOptions::from_voxel_size(voxel_size);
  options.noise.translation *= scale;
  options.noise.max_translation *= scale;
  options.information_unit *= scale;
  return options;
}

void Options::validate() const {
  consistency.validate();
  noise.validate();
  drift.validate();
  require(positive(information_unit), "information_unit", information_unit, "a finite number > 0");
  require(probability(min_edge_confidence), "min_edge_confidence", min_edge_confidence, "(0, 1]");
  require(probability(min_connection_confidence), "min_connection_confidence",
          min_connection_confidence, "(0, 1]");
  require(modes >= 1 && modes <= 16, "modes", modes, "1 to 16");
  require(min_island >= 2, "min_island", min_island, "2 or more");
  require(threads >= 0, "threads", threads, "0 or more");
}

RefineOptions RefineOptions::from_voxel_size(float voxel_size) {
  const double scale = scale_of(voxel_size);
  RefineOptions options;
  options.initial_distance *= scale;
  options.final_distance *= scale;
  options.kernel_width *= scale;
  options.point_noise *= scale;
  options.max_edge_error *= scale;
  return options;
}

RefineOptions RefineOptions::for_depth_cameras(float voxel_size) {
  RefineOptions options = from_voxel_size(voxel_size);
  options.noise_range = static_cast<double>(kNoiseRangeVoxels * voxel_size);
  return options;
}

void RefineOptions::validate() const {
  require(positive(initial_distance), "initial_distance", initial_distance, "a finite number > 0");
  require(positive(final_distance) && final_distance <= initial_distance, "final_distance",
          final_distance, "a finite number > 0 and <= initial_distance");
  require(max_normal_angle > 0 && max_normal_angle <= 90, "max_normal_angle", max_normal_angle,
          "(0, 90]");
  require(positive(kernel_width), "kernel_width", kernel_width, "a finite number > 0");
  require(iterations >= 1, "iterations", iterations, "1 or more");
  require(positive(max_edge_error), "max_edge_error", max_edge_error, "a finite number > 0");
  require(max_points >= 16, "max_points", max_points, "16 or more");
  require(min_overlap >= 1, "min_overlap", min_overlap, "1 or more");
  require(positive(point_noise), "point_noise", point_noise, "a finite number > 0");
  require(std::isfinite(correlated_points) && correlated_points >= 1, "correlated_points",
          correlated_points, "a finite number >= 1");
  require(noise_range > 0, "noise_range", noise_range, "a number > 0");
  require(threads >= 0, "threads", threads, "0 or more");
}

}  // namespace gpureg::reconstruction
