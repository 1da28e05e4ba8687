// SPDX-License-Identifier: BSD-3-Clause
#include "records/pose_text.hpp"

#include "text.hpp"

namespace gpureg::cli {

std::string pose_text(const Eigen::Matrix4d& pose) {
  std::string text;
  for (int row = 0; row < 4; ++row) {
    text += "   ";
    for (int column = 0; column < 4; ++column) {
      text += " " + pad_left(shortest(pose(row, column)), 23);
    }
    text += "\n";
  }
  return text;
}

}  // namespace gpureg::cli
