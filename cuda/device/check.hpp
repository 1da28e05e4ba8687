// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cuda_runtime_api.h>

namespace gpureg::cuda {

/// Throws DeviceError with the failed operation, the message of the runtime, and whether the
/// context stays usable.
[[noreturn]] void throw_device_error(cudaError_t error, const char* what);

inline void check(cudaError_t error, const char* what) {
  if (error != cudaSuccess) throw_device_error(error, what);
}

}  // namespace gpureg::cuda
