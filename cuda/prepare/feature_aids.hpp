// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <vector>

#include "cuda/common/nearest_feature.hpp"
#include "cuda/common/stage_data.hpp"

/// Search data beside the features: copies for the tensor cores, and error bounds of their
/// products. Writes the padded rows too. Part of assemble().
namespace gpureg::cuda {

/// Where each array of a FeatureAids begins in a cloud's memory.
struct FeatureAidsPlaces {
  static constexpr int kArrays = 4;
  std::size_t begin[kArrays];
};

/// Bytes of array k for a number of features; 0 where the dimension is unsupported.
std::size_t feature_aids_bytes(int k, std::size_t size, std::uint32_t dimension, HalfCopy copy);
FeatureAids feature_aids_at(char* memory, const FeatureAidsPlaces& places, HalfCopy copy);

/// Features of one cloud; all pointers on the device.
struct FeaturesToMeasure {
  const float* features;  ///< tight rows
  float* rows;            ///< to be filled: the rows of the cloud, padded with zeros
  const std::uint8_t* valid;
  std::uint32_t size, dimension;
  FeatureAids aids;        ///< laid out, to be filled
  std::uint32_t* extreme;  ///< counts features that are too long for the tensor cores
};

void fill_feature_aids(Exec& exec, const std::vector<FeaturesToMeasure>& clouds);

}  // namespace gpureg::cuda
