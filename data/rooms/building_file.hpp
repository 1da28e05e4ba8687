// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>

#include "data/mesh.hpp"

namespace gpureg::synthetic {

/// All triangles of a file, in metres, z up (glTF and COLLADA say which axis is; other formats are
/// taken as they are), painted in one colour each. Throws IoError (cannot be read, holds no
/// triangle, holds a coordinate that is no number) and BackendUnavailable (this build is without
/// Assimp).
Mesh read_building(const std::string& path);

}  // namespace gpureg::synthetic
