// SPDX-License-Identifier: BSD-3-Clause
// Stands in for cuda/ in builds without a CUDA compiler.
#include "gpureg/error.hpp"
#include "pipeline/engine.hpp"

namespace gpureg {

std::shared_ptr<Engine> make_cuda_engine(int) {
  throw BackendUnavailable("this build of gpureg has no CUDA backend (configure with -DGPUREG_CUDA=ON)");
}

std::vector<std::string> describe_cuda_devices() { return {"cuda: not in this build"}; }

}  // namespace gpureg
