// SPDX-License-Identifier: BSD-3-Clause
#include "cuda/device/memory.hpp"

#include <algorithm>
#include <cstdint>
#include <new>
#include <string>

#include "common/in_halves.hpp"
#include "cuda/device/check.hpp"
#include "gpureg/error.hpp"

namespace gpureg::cuda {

void throw_device_error(cudaError_t error, const char* what) {
  cudaGetLastError();  // clears a non-sticky error, which the next call would report
  const bool lost = cudaGetLastError() != cudaSuccess;
  throw DeviceError(
      std::string(what) + ": " + cudaGetErrorName(error) + ", " + cudaGetErrorString(error) +
      (lost ? "; the device's state is lost: no CUDA context of this process is usable any more"
            : "; the context stays usable"));
}

DeviceScope::DeviceScope(int device) {
  check(cudaGetDevice(&previous_), "cudaGetDevice");
  if (previous_ != device) check(cudaSetDevice(device), "cudaSetDevice");
}

DeviceScope::~DeviceScope() {
  if (previous_ >= 0) cudaSetDevice(previous_);
}

DeviceMemory::DeviceMemory(int device) : device_(device) {
  const DeviceScope scope(device);
  check(cudaStreamCreateWithFlags(&stream_, cudaStreamNonBlocking), "cudaStreamCreateWithFlags");
  cudaMemPoolProps properties{};
  properties.allocType = cudaMemAllocationTypePinned;
  properties.location.type = cudaMemLocationTypeDevice;
  properties.location.id = device;
  std::uint64_t threshold = ~std::uint64_t(0);
  int never = 0;
  cudaError_t error = cudaSuccess;
  for (cudaMemPool_t* pool : {&pool_, &lent_pool_}) {
    if (error == cudaSuccess) error = cudaMemPoolCreate(pool, &properties);
    if (error == cudaSuccess)
      error = cudaMemPoolSetAttribute(*pool, cudaMemPoolAttrReleaseThreshold, &threshold);
    // A stream of the program that allocates here must never wait for the engine's stream.
    if (error == cudaSuccess)
      error = cudaMemPoolSetAttribute(*pool, cudaMemPoolReuseAllowInternalDependencies, &never);
  }
  // The engine's stream reuses memory in its own order only. Reuse by completion would fragment the
  // pool differently from run to run, and a warm pool could lack a piece that is large enough.
  if (error == cudaSuccess)
    error = cudaMemPoolSetAttribute(pool_, cudaMemPoolReuseAllowOpportunistic, &never);
  if (error == cudaSuccess) return;
  destroy();
  throw_device_error(error, "cudaMemPoolCreate");
}

void DeviceMemory::allow_reading(int other_device) noexcept {
  int possible = 0;
  cudaMemAccessDesc access{};
  access.location.type = cudaMemLocationTypeDevice;
  access.location.id = other_device;
  access.flags = cudaMemAccessFlagsProtReadWrite;
  if (cudaDeviceCanAccessPeer(&possible, other_device, device_) != cudaSuccess || !possible ||
      cudaMemPoolSetAccess(pool_, &access, 1) != cudaSuccess)
    cudaGetLastError();
}

void DeviceMemory::destroy() noexcept {
  for (cudaMemPool_t pool : {pool_, lent_pool_})
    if (pool) cudaMemPoolDestroy(pool);
  cudaStreamDestroy(stream_);
}

DeviceMemory::~DeviceMemory() {
  for (const Late& late : late_) {
    cudaStreamWaitEvent(stream_, late.event, 0);
    cudaEventDestroy(late.event);
    free(late.pointer, late.bytes);
  }
  cudaStreamSynchronize(stream_);
  destroy();
}

cudaError_t DeviceMemory::try_to_allocate(void** pointer, std::size_t bytes, cudaStream_t stream) {
  if (allocations_left_ != kNever && allocations_left_-- <= 0) return cudaErrorMemoryAllocation;
  return cudaMallocFromPoolAsync(pointer, bytes, stream == stream_ ? pool_ : lent_pool_, stream);
}

void DeviceMemory::trim_all() {
  std::vector<std::shared_ptr<DeviceMemory>> others;
  for (const auto& other : others_)
    if (auto memory = other.lock()) others.push_back(std::move(memory));
  // All before any: each lane reads clouds in the memory of others.
  cudaStreamSynchronize(stream_);
  for (const auto& memory : others) cudaStreamSynchronize(memory->stream_);
  trim();
  for (const auto& memory : others) memory->trim();
}

void* DeviceMemory::allocate(std::size_t bytes, cudaStream_t stream) {
  void* pointer = nullptr;
  cudaError_t error = try_to_allocate(&pointer, bytes, stream);
  if (error == cudaErrorMemoryAllocation) {
    // The pool may hold only small pieces: release them and try once more.
    cudaGetLastError();
    trim_all();
    error = try_to_allocate(&pointer, bytes, stream);
  }
  if (error == cudaSuccess) {
    in_use_ += bytes;
    return pointer;
  }
  std::size_t free = 0, total = 0;
  if (error == cudaErrorMemoryAllocation &&
      (cudaGetLastError(), cudaMemGetInfo(&free, &total) == cudaSuccess))
    throw OutOfDeviceMemory("device " + std::to_string(device_) +
                            " is out of memory: " + std::to_string(bytes >> 20) +
                            " MiB asked for, " + std::to_string(free >> 20) + " of " +
                            std::to_string(total >> 20) + " MiB free; the context stays usable");
  throw_device_error(error, "cudaMallocFromPoolAsync");
}

void DeviceMemory::free(void* pointer, std::size_t bytes) noexcept {
  cudaFreeAsync(pointer, stream_);
  in_use_ -= bytes;
}

void DeviceMemory::free_after(void* pointer, std::size_t bytes, cudaEvent_t event) noexcept {
  try {
    const std::lock_guard<std::mutex> lock(late_mutex_);
    late_.push_back({pointer, bytes, event});
  } catch (const std::bad_alloc&) {
    // Without memory for the list, the stream waits after all.
    cudaStreamWaitEvent(stream_, event, 0);
    cudaEventDestroy(event);
    return free(pointer, bytes);
  }
  free_reached();
}

void DeviceMemory::free_reached() noexcept {
  const std::lock_guard<std::mutex> lock(late_mutex_);
  const auto reached = [&](const Late& late) {
    if (cudaEventQuery(late.event) == cudaErrorNotReady) return false;
    cudaEventDestroy(late.event);
    free(late.pointer, late.bytes);
    return true;
  };
  late_.erase(std::remove_if(late_.begin(), late_.end(), reached), late_.end());
}

void DeviceMemory::trim() noexcept {
  for (cudaMemPool_t pool : {pool_, lent_pool_}) cudaMemPoolTrimTo(pool, 0);
}

std::size_t DeviceMemory::bytes_reserved() const {
  std::uint64_t sum = 0;
  for (cudaMemPool_t pool : {pool_, lent_pool_}) {
    std::uint64_t bytes = 0;
    cudaMemPoolGetAttribute(pool, cudaMemPoolAttrReservedMemCurrent, &bytes);
    sum += bytes;
  }
  return sum;
}

PinnedBuffer::PinnedBuffer(std::size_t bytes) {
  void* data = nullptr;
  // Portable: a cloud evicted from one device may return to another.
  if (bytes > 0) check(cudaHostAlloc(&data, bytes, cudaHostAllocPortable), "cudaHostAlloc");
  data_ = static_cast<char*>(data);
}

PinnedBuffer::~PinnedBuffer() {
  if (data_) cudaFreeHost(data_);
}

PinnedArena::~PinnedArena() { clear(); }

void PinnedArena::clear() noexcept {
  for (const Chunk& chunk : chunks_) cudaFreeHost(chunk.data);
  chunks_.clear();
  current_ = 0;
}

void* PinnedArena::take(std::size_t bytes) {
  bytes = (bytes + 255) / 256 * 256;
  const auto full = [&](const Chunk& chunk) { return chunk.size - chunk.used < bytes; };
  while (current_ < chunks_.size() && full(chunks_[current_])) ++current_;
  if (current_ == chunks_.size()) {
    std::size_t size = std::max<std::size_t>(bytes, std::size_t(1) << 20);
    if (!chunks_.empty()) size = std::max(size, 2 * chunks_.back().size);
    chunks_.reserve(chunks_.size() + 1);
    void* data = nullptr;
    check(cudaHostAlloc(&data, size, cudaHostAllocDefault), "cudaHostAlloc");
    chunks_.push_back({static_cast<char*>(data), size, 0});
  }
  Chunk& chunk = chunks_[current_];
  void* piece = chunk.data + chunk.used;
  chunk.used += bytes;
  return piece;
}

void PinnedArena::reset() {
  for (Chunk& chunk : chunks_) chunk.used = 0;
  current_ = 0;
}

}  // namespace gpureg::cuda
