// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cmath>
#include <string>

#include "gpureg/error.hpp"

namespace gpureg::pose_graph {

/// A number as messages show it.
std::string shown(double value);

/// Throws InvalidArgument "field is value, expected ...".
void require(bool good, const std::string& field, double value, const char* expected);

inline void require_positive(const std::string& field, double value) {
  require(std::isfinite(value) && value > 0, field, value, "a finite number > 0");
}

inline void require_not_negative(const std::string& field, double value) {
  require(std::isfinite(value) && value >= 0, field, value, "a finite number >= 0");
}

}  // namespace gpureg::pose_graph
