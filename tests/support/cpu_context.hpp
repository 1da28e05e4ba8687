// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "gpureg/context.hpp"

namespace gpureg::test {

/// Of two threads, for all tests of a program.
inline const Context& context() {
  static const Context cpu = Context::cpu(2);
  return cpu;
}

}  // namespace gpureg::test
