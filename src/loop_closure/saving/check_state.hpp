// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "loop_closure/state.hpp"

namespace gpureg::loop_closure {

/// What a checksum cannot see: a file that another program has made. What passes is a state that
/// process() can go on with.
/// @throws InvalidArgument naming what is wrong.
void check_state(const State& state);

}  // namespace gpureg::loop_closure
