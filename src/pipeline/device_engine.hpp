// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "pipeline/engine.hpp"

namespace gpureg {

struct CudaOptions;
struct DeviceMemoryUse;

/// A cloud out of device memory, copied in order of the caller's stream.
struct AdoptedCloud {
  virtual ~AdoptedCloud() = default;
};

/// What engines on devices can do beyond others.
class DeviceEngine : public Engine {
 public:
  virtual std::vector<DeviceMemoryUse> device_memory() const = 0;
  /// Takes a cloud out of device memory without waiting for anything: its pointers are device
  /// pointers, but for the viewpoints. stream: a cudaStream_t. Throws InvalidArgument where none of
  /// the engine's devices has that memory.
  virtual std::shared_ptr<AdoptedCloud> adopt(const RawCloud& cloud, void* stream) = 0;
  virtual std::shared_ptr<PreparedState> prepare_adopted(const AdoptedCloud& cloud,
                                                         const PrepareOptions& options) = 0;
};

/// CUDA engine on the devices of the options. Throws BackendUnavailable.
std::shared_ptr<Engine> make_cuda_engine(const CudaOptions& options);

}  // namespace gpureg
