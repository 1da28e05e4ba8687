// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <memory>
#include <string>
#include <vector>

namespace gpureg {

class Engine;
struct Access;

enum class Backend { cpu, cuda };
const char* to_string(Backend backend);

/// How a CUDA context is set up.
struct CudaOptions {
  /// Devices of this host that share the work of a batch; results do not depend on them. Empty:
  /// every device of the machine.
  std::vector<int> devices{0};
  /// Bytes of each device's memory that prepared clouds may take; 0: no limit. The least recently
  /// used beyond it move to page-locked host memory and come back when an alignment needs them;
  /// results do not change. Room for the work itself comes on top.
  std::size_t memory_budget = 0;
};

/// Memory that a context has on one device.
struct DeviceMemoryUse {
  int device;
  std::size_t bytes_in_use;  ///< by prepared clouds and by work under way
  /// taken from the driver and kept for the next call: what was in use at most
  std::size_t bytes_reserved;
  std::size_t clouds_evicted;  ///< times that the memory budget drove a prepared cloud out
};

/// Where work runs: owns threads (CPU) or device, streams and memory (CUDA). Cheap to copy: copies
/// share the same resources.
///
/// Thread safety: one Context may be used by several threads; their calls take turns. Nothing is
/// global: two contexts are independent.
class Context {
 public:
  /// CPU backend with that many threads; 0: one per hardware thread. Throws BackendUnavailable
  /// where this CPU lacks what the library was compiled for, InvalidArgument for more than 1024
  /// threads.
  static Context cpu(unsigned threads = 0);

  /// CUDA backend on one device. Throws BackendUnavailable without CUDA in the build, driver or
  /// machine, or without that device.
  static Context cuda(int device = 0);

  /// CUDA backend on several devices of this host, or with a memory budget. Throws
  /// BackendUnavailable as above, InvalidArgument for a negative device.
  static Context cuda(const CudaOptions& options);

  /// CUDA where a device can be used, else the CPU.
  static Context best();

  Backend backend() const;
  unsigned threads() const;         ///< CPU threads that this context uses
  std::string description() const;  ///< e.g. "cpu, 8 threads" or "cuda:0, NVIDIA H200"

  /// One entry per device of a CUDA context, none on the CPU.
  std::vector<DeviceMemoryUse> device_memory() const;

 private:
  friend struct Access;
  explicit Context(std::shared_ptr<Engine> engine) : engine_(std::move(engine)) {}
  std::shared_ptr<Engine> engine_;
};

/// One line per backend of this build, with its devices or the reason why it cannot be used.
std::vector<std::string> describe_backends();

}  // namespace gpureg
