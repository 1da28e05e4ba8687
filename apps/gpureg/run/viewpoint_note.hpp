// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <string>

#include "gpureg/point_cloud.hpp"

namespace gpureg::cli {

/// Finds clouds whose normals show the back to all of their viewpoints: then free space speaks
/// against right poses, and nothing else would say why. Without prepare.depth_maps nobody asks.
class ViewpointNote {
 public:
  void see(const PointCloud& cloud, const std::string& file);
  /// One line on stderr; nothing where all is well.
  void print() const;

 private:
  std::size_t clouds_ = 0;
  double most_ = 0;
  std::string worst_;
};

}  // namespace gpureg::cli
