// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cmath>
#include <sstream>
#include <string>

#include "gpureg/error.hpp"

namespace gpureg {

template <typename T>
[[noreturn]] void throw_option(const char* field, T value, const char* expected) {
  std::ostringstream text;
  text << field << " is " << value << ", expected " << expected;
  throw InvalidArgument(text.str());
}

/// Throws InvalidArgument naming field and value unless ok.
template <typename T>
void require(bool ok, const char* field, T value, const char* expected) {
  if (!ok) throw_option(field, value, expected);
}

inline bool positive(float v) { return std::isfinite(v) && v > 0; }

}  // namespace gpureg
