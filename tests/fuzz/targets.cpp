// SPDX-License-Identifier: BSD-3-Clause
#include "fuzz/targets.hpp"

#include <stdexcept>

namespace gpureg::fuzz {

void broken(const std::string& promise) { throw std::logic_error("broken promise: " + promise); }

std::vector<Target> all_targets() {
  std::vector<Target> out = file_targets();
  for (const auto& more : {mesh_targets(), command_targets(), api_targets(), map_targets()})
    out.insert(out.end(), more.begin(), more.end());
  return out;
}

}  // namespace gpureg::fuzz
