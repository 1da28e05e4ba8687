// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cuda_runtime_api.h>

#include <atomic>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <memory>
#include <mutex>
#include <utility>
#include <vector>

namespace gpureg::cuda {

/// Makes a device current in the calling thread and restores the previous one at the end of the
/// scope.
class DeviceScope {
 public:
  explicit DeviceScope(int device);
  ~DeviceScope();
  DeviceScope(const DeviceScope&) = delete;
  DeviceScope& operator=(const DeviceScope&) = delete;

 private:
  int previous_ = -1;
};

/// A private stream and pool of device memory. The pool keeps its memory until trim(), so a warm
/// context allocates without the driver. The context and its prepared clouds share it.
class DeviceMemory {
 public:
  explicit DeviceMemory(int device);
  ~DeviceMemory();
  DeviceMemory(const DeviceMemory&) = delete;
  DeviceMemory& operator=(const DeviceMemory&) = delete;

  int device() const { return device_; }
  cudaStream_t stream() const { return stream_; }
  /// In stream order. Throws DeviceError where the device has no memory left.
  void* allocate(std::size_t bytes) { return allocate(bytes, stream_); }
  /// In the order of a stream of the program.
  void* allocate(std::size_t bytes, cudaStream_t stream);
  void free(void* pointer, std::size_t bytes) noexcept;
  /// Frees once an event is reached, and destroys the event. The stream never waits for it: where
  /// it is not reached yet, a later free_reached() frees.
  void free_after(void* pointer, std::size_t bytes, cudaEvent_t event) noexcept;
  void free_reached() noexcept;
  void trim() noexcept;  ///< returns the pools' free memory to the driver
  /// Lets another device read the memory where the hardware can: copies to it then take the direct
  /// link instead of the host's memory.
  void allow_reading(int other_device) noexcept;
  /// Where the device has no memory left, allocate() also takes the free memory of others.
  void take_from(const std::shared_ptr<DeviceMemory>& other) { others_.push_back(other); }
  std::size_t bytes_in_use() const { return in_use_; }
  std::size_t bytes_reserved() const;  ///< allocated from the driver: the peak of the use
  static constexpr std::int64_t kNever = std::numeric_limits<std::int64_t>::max();
  /// For tests: all allocations of the process after the next `count` ones fail as without memory.
  static void fail_after(std::int64_t count) { allocations_left_ = count; }

 private:
  cudaError_t try_to_allocate(void** pointer, std::size_t bytes, cudaStream_t stream);
  void trim_all();  ///< of all lanes, after their work
  void destroy() noexcept;

  inline static std::atomic<std::int64_t> allocations_left_{kNever};
  int device_;
  cudaStream_t stream_ = nullptr;
  cudaMemPool_t pool_ = nullptr;
  cudaMemPool_t lent_pool_ = nullptr;  ///< for allocations on other streams
  std::vector<std::weak_ptr<DeviceMemory>> others_;
  std::atomic<std::size_t> in_use_{0};
  struct Late {
    void* pointer;
    std::size_t bytes;
    cudaEvent_t event;
  };
  std::mutex late_mutex_;
  std::vector<Late> late_;  ///< to be freed after their events
};

/// Owns an array in device memory; its content is undefined until written.
template <typename T>
class DeviceBuffer {
 public:
  DeviceBuffer() = default;
  DeviceBuffer(std::shared_ptr<DeviceMemory> memory, std::size_t size)
      : memory_(std::move(memory)),
        size_(size),
        data_(size == 0 ? nullptr : static_cast<T*>(memory_->allocate(size * sizeof(T)))) {}
  DeviceBuffer(DeviceBuffer&& other) noexcept
      : memory_(std::move(other.memory_)),
        size_(std::exchange(other.size_, 0)),
        data_(std::exchange(other.data_, nullptr)) {}
  DeviceBuffer& operator=(DeviceBuffer&& other) noexcept {
    std::swap(memory_, other.memory_);
    std::swap(size_, other.size_);
    std::swap(data_, other.data_);
    return *this;
  }
  ~DeviceBuffer() {
    if (data_) memory_->free(data_, size_ * sizeof(T));
  }

  T* data() const { return data_; }
  std::size_t size() const { return size_; }
  const std::shared_ptr<DeviceMemory>& memory() const { return memory_; }

 private:
  std::shared_ptr<DeviceMemory> memory_;
  std::size_t size_ = 0;
  T* data_ = nullptr;
};

/// Owns page-locked host memory: the device copies to and from it at full speed.
class PinnedBuffer {
 public:
  PinnedBuffer() = default;
  explicit PinnedBuffer(std::size_t bytes);
  PinnedBuffer(PinnedBuffer&& other) noexcept : data_(std::exchange(other.data_, nullptr)) {}
  PinnedBuffer& operator=(PinnedBuffer&& other) noexcept {
    std::swap(data_, other.data_);
    return *this;
  }
  ~PinnedBuffer();

  char* data() const { return data_; }

 private:
  char* data_ = nullptr;
};

/// Page-locked host memory handed out piece by piece for one call and taken back as a whole. Grows
/// to what the largest call needs. A call like one made before neither allocates nor frees, because
/// freeing waits for all work on the device, that of other streams too.
class PinnedArena {
 public:
  PinnedArena() = default;
  ~PinnedArena();
  PinnedArena(const PinnedArena&) = delete;
  PinnedArena& operator=(const PinnedArena&) = delete;

  void* take(std::size_t bytes);
  /// Requires that no work uses the pieces any more.
  void reset();
  /// reset() that keeps no memory.
  void clear() noexcept;

 private:
  struct Chunk {
    char* data;
    std::size_t size, used;
  };
  std::vector<Chunk> chunks_;
  std::size_t current_ = 0;  ///< the chunk that the next piece is looked for in
};

}  // namespace gpureg::cuda
