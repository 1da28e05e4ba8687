// SPDX-License-Identifier: BSD-3-Clause
#include "data/rooms/building_file.hpp"
#include "gpureg/error.hpp"

namespace gpureg::synthetic {

Mesh read_building(const std::string& path) {
  throw BackendUnavailable(
      path + ": buildings cannot be read in this build, which was made without Assimp");
}

}  // namespace gpureg::synthetic
