// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <utility>

#include "cuda/device/exec.hpp"
#include "cuda/device/profiler_range.hpp"

namespace gpureg::cuda {

/// Thread blocks of a launch, threads of each block, and bytes of shared memory of each block
/// beside the kernel's own arrays.
struct LaunchShape {
  dim3 blocks;
  unsigned threads;
  std::size_t shared = 0;
};

/// A thread for each item, in blocks of so many; rows: the same for each of them (y).
inline LaunchShape shape_for(std::size_t items, unsigned threads, std::size_t rows = 1) {
  return {{blocks_for(items, threads), static_cast<unsigned>(rows)}, threads};
}

/// Enqueues a kernel; an error names it.
template <typename... Parameters, typename... Arguments>
void launch(cudaStream_t stream, const char* name, void (*kernel)(Parameters...),
            const LaunchShape& shape, Arguments&&... arguments) {
  const ProfilerRange range(name);
  kernel<<<shape.blocks, shape.threads, shape.shared, stream>>>(
      std::forward<Arguments>(arguments)...);
  check(cudaGetLastError(), name);
}
template <typename... Parameters, typename... Arguments>
void launch(Exec& exec, const char* name, void (*kernel)(Parameters...), const LaunchShape& shape,
            Arguments&&... arguments) {
  launch(exec.stream(), name, kernel, shape, std::forward<Arguments>(arguments)...);
}

}  // namespace gpureg::cuda
