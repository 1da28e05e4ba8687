// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <vector>

#include "math/span.hpp"
#include "memory.hpp"

namespace gpureg::cuda {

/// Rows of the caller's, in any host memory, and where they are to lie tight on the device.
struct RowsToUpload {
  const float* rows;
  std::size_t count, width, stride;  ///< floats
  float* device;
};

/// Brings ordinary host memory to the device at the speed of the bus: some threads pack pieces into
/// page-locked slots, which the device copies while the next are packed. The slots are few:
/// page-locked memory is slow to come by.
class Uploader {
 public:
  Uploader() = default;
  ~Uploader();
  Uploader(const Uploader&) = delete;
  Uploader& operator=(const Uploader&) = delete;

  /// In order with the stream of that device. The rows may be changed when the call returns.
  void upload(Span<const RowsToUpload> parts, int device, cudaStream_t stream);

 private:
  static constexpr std::size_t kThreads = 4, kSlots = 4;  // slots of each thread
  static constexpr std::size_t kSlotBytes = std::size_t(1) << 19;
  void prepare_slots();

  PinnedBuffer slots_;
  std::array<cudaEvent_t, kThreads * kSlots> free_{};  // when a slot may be written again
};

}  // namespace gpureg::cuda
