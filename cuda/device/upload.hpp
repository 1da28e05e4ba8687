// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <mutex>
#include <vector>

#include "cuda/device/memory.hpp"
#include "math/span.hpp"

namespace gpureg::cuda {

/// Rows in any host memory, and their tight destination on the device.
struct RowsToUpload {
  const float* rows;
  std::size_t count, width, stride;  ///< floats
  float* device;
};

/// Uploads pageable host memory at the speed of the bus: several threads pack pieces into
/// page-locked slots, which the device copies while they pack the next ones. The slots are few,
/// because page-locked memory is slow to allocate; large, because each costs the driver two calls.
/// Thread-safe: uploads go one after the other.
class Uploader {
 public:
  Uploader() = default;
  ~Uploader();
  Uploader(const Uploader&) = delete;
  Uploader& operator=(const Uploader&) = delete;

  /// In the order of the stream. The rows may change when the call returns.
  void upload(Span<const RowsToUpload> parts, int device, cudaStream_t stream);
  /// Frees the slots until the next upload. Requires that the streams of all uploads were awaited.
  void clear() noexcept;

 private:
  static constexpr std::size_t kThreads = 8, kSlots = 2;  // slots of each thread
  static constexpr std::size_t kSlotBytes = std::size_t(1) << 20;
  void prepare_slots();

  std::mutex mutex_;
  PinnedBuffer slots_;
  std::array<cudaEvent_t, kThreads * kSlots> free_{};  // when a slot may be written again
};

}  // namespace gpureg::cuda
