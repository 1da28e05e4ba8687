// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <memory>
#include <string>
#include <vector>

namespace gpureg {

class Engine;

enum class Backend { cpu, cuda };
const char* to_string(Backend backend);

/// Where work runs: owns threads (CPU) or device, streams and memory (CUDA). Cheap to copy: copies share the same resources.
///
/// Thread safety: one Context may be used by several threads; their calls take turns. Nothing is global: two contexts are independent.
class Context {
 public:
  /// CPU backend with that many threads; 0: one per hardware thread. Throws BackendUnavailable where this CPU lacks what the library
  /// was compiled for, InvalidArgument for more than 1024 threads.
  static Context cpu(unsigned threads = 0);

  /// CUDA backend on one device. Throws BackendUnavailable without CUDA in the build, driver or machine, or without that device.
  static Context cuda(int device = 0);

  /// CUDA where a device can be used, else the CPU.
  static Context best();

  Backend backend() const;
  unsigned threads() const;          ///< CPU threads that this context uses
  std::string description() const;   ///< e.g. "cpu, 8 threads" or "cuda:0 NVIDIA H200"

  const std::shared_ptr<Engine>& engine() const { return engine_; }  ///< private interface of the backends

 private:
  explicit Context(std::shared_ptr<Engine> engine) : engine_(std::move(engine)) {}
  std::shared_ptr<Engine> engine_;
};

/// One line per backend of this build, with its devices or the reason why it cannot be used.
std::vector<std::string> describe_backends();

}  // namespace gpureg
