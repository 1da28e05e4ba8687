// SPDX-License-Identifier: BSD-3-Clause
#include <cmath>

#include "files/text_file.hpp"
#include "gpureg/io.hpp"

namespace gpureg::io {

std::map<int, std::vector<Eigen::Vector3d>> read_cameras(const std::string& path) {
  std::map<int, std::vector<Eigen::Vector3d>> cameras;
  files::TextFile file(path, '#');
  while (file.next()) {
    if (file.fields().size() != 9)
      file.fail("a camera has " + std::to_string(file.fields().size()) +
                " fields, expected 9: fragment frame tx ty tz qx qy qz qw");
    const int fragment = file.index(0, "fragment");
    file.index(1, "frame");
    const Eigen::Vector3d position(file.number(2, "tx"), file.number(3, "ty"),
                                   file.number(4, "tz"));
    if (!position.cast<float>().allFinite())
      file.fail("the camera is farther away than a float can tell");
    const Eigen::Vector4d q(file.number(5, "qx"), file.number(6, "qy"), file.number(7, "qz"),
                            file.number(8, "qw"));
    // Six digits leave 1e-6; the bound only detects columns that are no quaternion.
    constexpr double kNormTolerance = 1e-3;
    if (std::abs(q.norm() - 1) > kNormTolerance)
      file.fail("the quaternion has length " + std::to_string(q.norm()) + ", expected 1");
    cameras[fragment].push_back(position);
  }
  return cameras;
}

}  // namespace gpureg::io
