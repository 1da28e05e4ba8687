// SPDX-License-Identifier: BSD-3-Clause
// Prints the layout of the public types as this program sees them, and sends Eigen matrices by
// value and by reference through the library: a program may be compiled for another processor than
// the library was.
#include "layout.hpp"

#include <iostream>

int main() {
  std::cout << layout();
  gpureg::RegistrationResult result;
  result.source_moments.count = 3;
  result.source_moments.sum = {1, 2, 3};
  result.source_moments.outer = Eigen::Vector3d(4, 5, 6).asDiagonal();
  const Eigen::Matrix<double, 6, 6> information =
      result.source_moments.information_redwood().array() + 0.0;  // no -0
  Eigen::Matrix4d moved = Eigen::Matrix4d::Identity();
  moved(0, 3) = 0.25;
  std::cout << "information\n"
            << information << "\nerror "
            << gpureg::evaluation::redwood_error(Eigen::Matrix4d::Identity(), moved, information)
            << "\n";
}
