// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cuda_runtime_api.h>
#include <gtest/gtest.h>

#include "cuda/device/exec.hpp"

namespace gpureg::test {

inline bool has_gpu() {
  int devices = 0;
  const bool found = cudaGetDeviceCount(&devices) == cudaSuccess && devices > 0;
  cudaGetLastError();
  return found;
}

/// Host copy of an array on the device.
template <typename T>
std::vector<T> host(cuda::Exec& exec, const T* device, std::size_t size) {
  const T* staged = exec.download(device, size);
  exec.synchronize();
  return std::vector<T>(staged, staged + size);
}

/// Equal as bytes, so that 0 differs from -0.
template <typename T>
::testing::AssertionResult same_bytes(const std::vector<T>& cpu, const std::vector<T>& cuda) {
  if (cpu.size() != cuda.size())
    return ::testing::AssertionFailure() << "sizes " << cpu.size() << " and " << cuda.size();
  std::size_t different = 0, first = 0;
  for (std::size_t k = cpu.size(); k-- > 0;)
    if (std::memcmp(&cpu[k], &cuda[k], sizeof(T)) != 0) {
      ++different;
      first = k;
    }
  if (different == 0) return ::testing::AssertionSuccess();
  return ::testing::AssertionFailure()
         << different << " of " << cpu.size() << " differ, the first at " << first;
}

}  // namespace gpureg::test

#define GPUREG_GPU_OR_SKIP() \
  if (!::gpureg::test::has_gpu()) GTEST_SKIP() << "no CUDA device on this machine"
