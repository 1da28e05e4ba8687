// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "pipeline/engine.hpp"

namespace gpureg {

struct CudaOptions;
struct DeviceMemoryUse;

/// A cloud copied from device memory in the order of a stream of the program.
struct AdoptedCloud {
  virtual ~AdoptedCloud() = default;
};

/// Streams of the program that order the reading of a cloud's rows; each is a cudaStream_t.
struct RowStreams {
  void *points, *normals, *features;
};

/// Additional operations of engines on devices.
class DeviceEngine : public Engine {
 public:
  bool leaves_host_idle() const override { return true; }
  virtual std::vector<DeviceMemoryUse> device_memory() const = 0;
  /// Returns memory without a use to the driver.
  virtual void trim() = 0;
  /// Copies a cloud from device memory without waiting: all pointers but the viewpoints are device
  /// pointers. Throws InvalidArgument where the memory is on none of the engine's devices.
  virtual std::shared_ptr<AdoptedCloud> adopt(const RawCloud& cloud, const RowStreams& streams) = 0;
  /// Waits for the copies, then prepares them as one batch. Other calls do not wait for the copies.
  virtual std::vector<std::shared_ptr<PreparedState>> prepare_adopted(
      Span<const std::shared_ptr<AdoptedCloud>> clouds, const PrepareSettings& options) = 0;
  /// Waits for the copy. @return host copy of the points of an adopted cloud, rows of x, y, z.
  virtual std::vector<float> copy_points(const AdoptedCloud& cloud) = 0;
};

/// CUDA engine on the devices of the options. Throws BackendUnavailable.
std::shared_ptr<Engine> make_cuda_engine(const CudaOptions& options);

}  // namespace gpureg
