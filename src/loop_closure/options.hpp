// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "gpureg/loop_closure.hpp"

namespace gpureg::loop_closure {

/// The options with their lengths in the unit of the points.
/// @throws InvalidArgument naming field and value.
Options in_units(const Options& options);

}  // namespace gpureg::loop_closure
