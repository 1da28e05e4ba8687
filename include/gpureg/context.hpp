// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <memory>
#include <string>
#include <vector>

namespace gpureg {

class Engine;
struct Access;

/// Processor that runs the pipeline. Results do not depend on it.
enum class Backend { cpu, cuda };

/// @return "cpu" or "cuda".
const char* to_string(Backend backend);

/// Options of a CUDA context.
struct CudaOptions {
  /// Devices of this host that share the work of a batch; results do not depend on them. Empty:
  /// every device of the machine.
  std::vector<int> devices{0};
  /// Bytes of the memory of each device that prepared clouds may occupy; 0: no limit. Beyond it the
  /// least recently used clouds move to page-locked host memory, and back when an alignment needs
  /// them; results do not change. Memory for the work itself comes on top.
  std::size_t memory_budget = 0;
};

/// Memory of a context on one device.
struct DeviceMemoryUse {
  int device;                ///< CUDA device index
  std::size_t bytes_in_use;  ///< by prepared clouds and running work
  /// Allocated from the driver and kept for later calls: the peak of bytes_in_use.
  std::size_t bytes_reserved;
  std::size_t clouds_evicted;  ///< evictions of prepared clouds under the memory budget
};

/// Owns the resources of a backend: threads (CPU), or device, streams and memory (CUDA). Copies
/// share the same resources.
///
/// Thread-safe: threads may share one Context. On the CPU their calls run one after another. On
/// CUDA up to four small calls (fewer than 128 pairs) run at the same time, two of them beside a
/// large one; large calls, and all calls under a memory budget, run one after another. Two contexts
/// are independent, nothing is global.
class Context {
 public:
  /// CPU backend.
  /// @param threads number of threads, at most 1024; 0: one per hardware thread.
  /// @throws BackendUnavailable if this CPU lacks instructions that the library was compiled
  ///   for.
  /// @throws InvalidArgument for more than 1024 threads.
  static Context cpu(unsigned threads = 0);

  /// CUDA backend on one device.
  /// @param device CUDA device index.
  /// @throws BackendUnavailable without CUDA in the build, without a driver, or without that
  ///   device.
  static Context cuda(int device = 0);

  /// CUDA backend on several devices of this host, or with a memory budget.
  /// @throws BackendUnavailable as above.
  /// @throws InvalidArgument for a negative device.
  static Context cuda(const CudaOptions& options);

  /// @return a CUDA context if a device is usable, otherwise a CPU context.
  static Context best();

  Backend backend() const;
  unsigned threads() const;         ///< CPU threads of this context
  std::string description() const;  ///< e.g. "cpu, 8 threads" or "cuda:0, NVIDIA H200"

  /// @return one entry per device of a CUDA context, none on the CPU.
  std::vector<DeviceMemoryUse> device_memory() const;

  /// Returns the memory that the context keeps for later calls, on its devices and page-locked on
  /// the host, to the driver: for programs that share a device. Prepared clouds stay; the next call
  /// allocates anew. Waits for running calls. Does nothing on the CPU. Thread-safe.
  /// @throws DeviceError if running work failed.
  void trim() const;

 private:
  friend struct Access;
  explicit Context(std::shared_ptr<Engine> engine) : engine_(std::move(engine)) {}
  std::shared_ptr<Engine> engine_;
};

/// @return one line per backend of this build, with its devices or the reason why it is
///   unavailable.
std::vector<std::string> describe_backends();

}  // namespace gpureg
