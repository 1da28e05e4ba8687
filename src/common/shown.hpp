// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdio>
#include <string>

namespace gpureg {

/// A number as messages show it: never as 0 unless it is.
inline std::string shown(double value, int digits = 9) {
  char text[32];
  std::snprintf(text, sizeof text, "%.*g", digits, value);
  return text;
}
inline std::string shown(float value) { return shown(static_cast<double>(value), 6); }

}  // namespace gpureg
