// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <string>

#include "gpureg/point_cloud.hpp"

namespace gpureg::cli {

/// Finds clouds whose normals show the back to all of their viewpoints, or whose viewpoints are far
/// away from them: then free space speaks against correct poses, and nothing else would say why.
/// Without prepare.depth_maps nobody asks.
class ViewpointNote {
 public:
  void see(const PointCloud& cloud, const std::string& file);
  /// One line of each kind on stderr; nothing where all is well.
  void print() const;

 private:
  std::size_t clouds_ = 0;
  double most_ = 0;
  std::string worst_;
  std::size_t far_clouds_ = 0;
  double farthest_ = 0, extent_of_farthest_ = 0;
  std::string farthest_file_;
};

}  // namespace gpureg::cli
