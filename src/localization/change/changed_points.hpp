// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "gpureg/change.hpp"
#include "localization/surface.hpp"

namespace gpureg::localization {

/// What is asked about the points of one cloud, in the frame of the other one's surface.
struct Question {
  std::vector<Eigen::Vector3f> points;
  std::vector<float> tolerances;  ///< one per point
  float spacing = 0;              ///< changed points farther apart do not hang together
  ChangeLabel changed = ChangeLabel::appeared;
};

/// Labels the points by the surface of the other cloud.
PointChanges changed_points(const Question& question, const Surface& other, double min_extent,
                            unsigned threads);

}  // namespace gpureg::localization
