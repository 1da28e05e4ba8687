// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>

#include "data/mesh.hpp"

namespace gpureg::synthetic {

/// Gives every connected part of a building that was read from a file a pattern and a second colour
/// beside the file's: files hold one colour for each material, and a camera cannot be tracked
/// before bare walls. The same mesh and seed give the same materials.
void texture_building(Mesh& mesh, std::uint64_t seed);

}  // namespace gpureg::synthetic
