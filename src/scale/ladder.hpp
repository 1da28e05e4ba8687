// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <vector>

#include "gpureg/registration/scale.hpp"

namespace gpureg::scale {

/// Ratio of neighbouring rungs. Features find their matches within a fifth of the true scale.
constexpr double kStep = 1.2;
/// Prepared points of a cloud at a rung: fewer say nothing, more take longer than all other rungs.
constexpr std::size_t kLeastPoints = 150, kMostPoints = 30'000;

/// Scales of the source that are worth a comparison, ascending: powers of kStep at which it has
/// between kLeastPoints and kMostPoints voxels, or nearly all of its points stand alone beyond
/// that.
std::vector<double> ladder_of(const PointCloudView& source, const ScaleRange& range, float voxel);

/// The cloud multiplied by a scale; its points, viewpoints and origin are here.
class ScaledCloud {
 public:
  ScaledCloud(const PointCloudView& cloud, double scale);
  ScaledCloud(const ScaledCloud&) = delete;
  ScaledCloud& operator=(const ScaledCloud&) = delete;
  const PointCloudView& view() const { return view_; }

 private:
  std::vector<float> points_, viewpoints_;
  PointCloudView view_;
};

}  // namespace gpureg::scale
