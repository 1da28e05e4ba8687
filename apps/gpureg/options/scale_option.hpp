// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>

#include "command_line.hpp"
#include "gpureg/point_cloud.hpp"
#include "gpureg/registration/scale.hpp"

namespace gpureg::cli {

/// `--scale free|MIN:MAX|VALUE`: target's unit per unit of the source.
struct ScaleChoice {
  std::string text;  ///< empty: 1

  void add_to(Verb& verb);
  bool given() const { return !text.empty(); }
  /// @throws InvalidArgument naming option and text.
  ScaleRange range() const;
};

/// Multiplies points, viewpoints and origin.
void scale_cloud(PointCloud& cloud, double scale);

}  // namespace gpureg::cli
