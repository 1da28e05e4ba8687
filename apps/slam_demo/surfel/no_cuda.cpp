// SPDX-License-Identifier: BSD-3-Clause
#include <stdexcept>

#include "surfel_map.hpp"

namespace surfel {

bool cuda_available() { return false; }

std::unique_ptr<SurfelMap> make_cuda_map(const Options&) {
  throw std::runtime_error("this build has no CUDA surfels");
}

}  // namespace surfel
