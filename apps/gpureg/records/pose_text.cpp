// SPDX-License-Identifier: BSD-3-Clause
#include "records/pose_text.hpp"

#include "text.hpp"

namespace gpureg::cli {

std::string pose_text(const Eigen::Matrix4d& pose) {
  std::string text;
  for (int row = 0; row < 4; ++row) {
    text += "   ";
    for (int column = 0; column < 4; ++column) {
      const bool rotation = column < 3;
      text += " " + pad_left(fixed(pose(row, column), rotation ? 12 : 6), rotation ? 15 : 16);
    }
    text += "\n";
  }
  return text;
}

}  // namespace gpureg::cli
