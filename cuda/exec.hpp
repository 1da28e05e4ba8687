// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <algorithm>
#include <cstdint>
#include <cstring>
#include <thread>
#include <vector>

#include "check.hpp"
#include "math/span.hpp"
#include "memory.hpp"
#include "upload.hpp"

namespace gpureg::cuda {

/// Stream, memory and clock of the CUDA backend. Stages enqueue work on the stream; nothing of
/// theirs runs on the default stream.
class Exec {
 public:
  explicit Exec(int device);
  ~Exec();
  Exec(const Exec&) = delete;
  Exec& operator=(const Exec&) = delete;

  int device() const { return memory_->device(); }
  cudaStream_t stream() const { return memory_->stream(); }
  const std::shared_ptr<DeviceMemory>& memory() const { return memory_; }
  int multiprocessors() const { return multiprocessors_; }
  int compute_capability() const { return compute_capability_; }  ///< 90 for 9.0
  /// Host threads that may share the host's work on a batch. More than eight wait for memory.
  unsigned host_threads() const { return std::clamp(std::thread::hardware_concurrency(), 1u, 8u); }
  std::size_t shared_bytes_per_block() const { return shared_bytes_per_block_; }

  /// Begins a call: what the last one staged is free again, its events too.
  void begin();
  /// Waits for everything enqueued.
  void synchronize();
  /// Keeps something alive until the next synchronize(): what the work enqueued reads.
  void hold(std::shared_ptr<const void> what) { held_.push_back(std::move(what)); }

  template <typename T>
  DeviceBuffer<T> buffer(std::size_t size) {
    return DeviceBuffer<T>(memory_, size);
  }
  /// Filled with one byte value.
  template <typename T>
  DeviceBuffer<T> filled(std::size_t size, int byte) {
    DeviceBuffer<T> out(memory_, size);
    if (size > 0)
      check(cudaMemsetAsync(out.data(), byte, size * sizeof(T), stream()), "cudaMemsetAsync");
    return out;
  }
  /// Page-locked host memory, the caller's until the next begin().
  template <typename T>
  T* staging(std::size_t size) {
    return static_cast<T*>(staging_.take(size * sizeof(T)));
  }
  /// For large arrays of the caller's.
  Uploader& uploader() { return uploader_; }
  template <typename T>
  DeviceBuffer<T> upload(const T* host, std::size_t size) {
    DeviceBuffer<T> out(memory_, size);
    if (size == 0) return out;
    T* staged = staging<T>(size);
    std::memcpy(static_cast<void*>(staged), host, size * sizeof(T));
    check(cudaMemcpyAsync(out.data(), staged, size * sizeof(T), cudaMemcpyHostToDevice, stream()),
          "cudaMemcpyAsync to the device");
    return out;
  }
  template <typename T>
  DeviceBuffer<T> upload(const std::vector<T>& host) {
    return upload(host.data(), host.size());
  }
  /// The copy is there after the next synchronize().
  template <typename T>
  const T* download(const T* device, std::size_t size) {
    T* staged = staging<T>(size);
    if (size > 0)
      check(cudaMemcpyAsync(staged, device, size * sizeof(T), cudaMemcpyDeviceToHost, stream()),
            "cudaMemcpyAsync to the host");
    return staged;
  }

  /// A point in the stream's time, and the time between two of them; waits for the second.
  using Mark = std::size_t;
  Mark mark();
  double milliseconds(Mark from, Mark to) const;

 private:
  std::shared_ptr<DeviceMemory> memory_;
  PinnedArena staging_;
  Uploader uploader_;
  std::vector<std::shared_ptr<const void>> held_;
  std::vector<cudaEvent_t> events_;
  std::size_t events_used_ = 0;
  int multiprocessors_ = 1, compute_capability_ = 0;
  std::size_t shared_bytes_per_block_ = 48 << 10;
};

/// Blocks of `threads` that cover `items`.
inline unsigned blocks_for(std::size_t items, unsigned threads) {
  return static_cast<unsigned>((items + threads - 1) / threads);
}

}  // namespace gpureg::cuda
