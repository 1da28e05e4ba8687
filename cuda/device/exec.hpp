// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <algorithm>
#include <cstdint>
#include <cstring>
#include <thread>
#include <utility>
#include <vector>

#include "cuda/device/check.hpp"
#include "cuda/device/memory.hpp"
#include "cuda/device/upload.hpp"
#include "math/span.hpp"

namespace gpureg::cuda {

/// Stream, memory and clock of the CUDA backend. Stages enqueue work on this stream, never on the
/// default stream.
class Exec {
 public:
  explicit Exec(int device, std::shared_ptr<Uploader> uploader = std::make_shared<Uploader>());
  ~Exec();
  Exec(const Exec&) = delete;
  Exec& operator=(const Exec&) = delete;

  int device() const { return memory_->device(); }
  cudaStream_t stream() const { return memory_->stream(); }
  const std::shared_ptr<DeviceMemory>& memory() const { return memory_; }
  int multiprocessors() const { return multiprocessors_; }
  /// Architecture that the code of a kernel was compiled for, 90 for 9.0. Lower than that of the
  /// device where the driver translates older PTX. The code contains the instructions of this
  /// architecture only, so the choice of a kernel depends on it, not on the device.
  int compiled_for(const void* kernel) const;
  template <typename... Arguments>
  int compiled_for(void (*kernel)(Arguments...)) const {
    return compiled_for(reinterpret_cast<const void*>(kernel));
  }
  /// Number of host threads for the work on a batch; more than eight saturate the memory.
  unsigned host_threads() const { return std::clamp(std::thread::hardware_concurrency(), 1u, 8u); }
  /// Lets a kernel use all the shared memory that a thread block may have, and returns the bytes
  /// that a launch may ask for beside the kernel's own arrays. The permission belongs to the
  /// device: all contexts and threads set the same value, so none takes it from another between the
  /// setting and the launch.
  std::size_t allow_shared_memory(const void* kernel);
  template <typename... Arguments>
  std::size_t allow_shared_memory(void (*kernel)(Arguments...)) {
    return allow_shared_memory(reinterpret_cast<const void*>(kernel));
  }

  /// Begins a call: frees the staging memory and the events of the previous one.
  void begin();
  /// Waits for everything enqueued, then frees all memory that nothing uses, apart from the
  /// uploader's.
  void trim();
  /// Waits for everything enqueued.
  void synchronize();
  /// Keeps data of enqueued work alive until the next synchronize().
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
  /// Page-locked host memory, valid until the next begin().
  template <typename T>
  T* staging(std::size_t size) {
    return static_cast<T*>(staging_.take(size * sizeof(T)));
  }
  /// Upload of large arrays from any host memory.
  Uploader& uploader() { return *uploader_; }
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
  std::shared_ptr<Uploader> uploader_;
  std::vector<std::shared_ptr<const void>> held_;
  std::vector<cudaEvent_t> events_;
  std::size_t events_used_ = 0;
  int multiprocessors_ = 1;
  std::size_t shared_bytes_per_block_ = 48 << 10;
  /// Kernels that have the permission, with its bytes.
  std::vector<std::pair<const void*, std::size_t>> allowed_;
};

/// Number of blocks of `threads` that cover `items` elements.
inline unsigned blocks_for(std::size_t items, unsigned threads) {
  return static_cast<unsigned>((items + threads - 1) / threads);
}

/// Items of each thread block along a loop that several blocks share: halved from `most` down to
/// `least` until `rows` such loops give every multiprocessor two blocks.
inline std::uint32_t items_per_block(const Exec& exec, std::size_t rows, std::uint32_t items,
                                     std::uint32_t most, std::uint32_t least) {
  const std::size_t enough = 2 * static_cast<std::size_t>(exec.multiprocessors());
  while (most > least && rows * blocks_for(items, most) < enough) most /= 2;
  return most;
}

}  // namespace gpureg::cuda
