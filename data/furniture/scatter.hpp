// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>

#include "data/rooms/house.hpp"

namespace gpureg::synthetic {

/// Puts things into a building that was read from a file, so that rooms that were copied differ as
/// real ones do: `density` pieces of furniture per square metre at random places and turns, as many
/// small things on tables and pictures on walls. Throws InvalidArgument as WalkMap does.
void scatter(House& house, std::uint64_t seed, double density);

}  // namespace gpureg::synthetic
