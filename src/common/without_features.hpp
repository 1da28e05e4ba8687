// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <vector>

#include "gpureg/point_cloud.hpp"

namespace gpureg {

/// Views of clouds whose features nobody needs: one constant per point takes their place, which is
/// cheaper.
class WithoutFeatures {
 public:
  /// most: points of the largest cloud, 0 of an empty one, whose view needs a pointer, too.
  explicit WithoutFeatures(std::size_t most) : constant_(most + 1, 0) {}

  /// As long as this object lives.
  PointCloudView of(PointCloudView view) const {
    view.features = constant_.data();
    view.feature_dimension = view.feature_stride = 1;
    return view;
  }

 private:
  std::vector<float> constant_;
};

}  // namespace gpureg
