// SPDX-License-Identifier: BSD-3-Clause
#include "cuda/device/upload.hpp"

#include <algorithm>
#include <atomic>
#include <cstring>
#include <thread>

#include "common/host_threads.hpp"
#include "cuda/device/check.hpp"

namespace gpureg::cuda {
namespace {

void pack_rows(const RowsToUpload& part, float* out) {
  if (part.stride == part.width) {
    std::memcpy(out, part.rows, part.count * part.width * sizeof(float));
  } else {
    for (std::size_t i = 0; i < part.count; ++i)
      std::copy_n(part.rows + i * part.stride, part.width, out + i * part.width);
  }
}

}  // namespace

Uploader::~Uploader() {
  for (cudaEvent_t event : free_)
    if (event) cudaEventDestroy(event);
}

void Uploader::clear() noexcept {
  const std::lock_guard<std::mutex> lock(mutex_);
  slots_ = PinnedBuffer();
}

void Uploader::prepare_slots() {
  if (!slots_.data()) slots_ = PinnedBuffer(kThreads * kSlots * kSlotBytes);
  for (cudaEvent_t& event : free_)
    if (!event)
      check(cudaEventCreateWithFlags(&event, cudaEventDisableTiming), "cudaEventCreateWithFlags");
}

void Uploader::upload(Span<const RowsToUpload> parts, int device, cudaStream_t stream) {
  std::vector<RowsToUpload> pieces;
  for (const RowsToUpload& part : parts) {
    const std::size_t rows = kSlotBytes / (part.width * sizeof(float));
    for (std::size_t first = 0; first < part.count; first += rows)
      pieces.push_back({part.rows + first * part.stride, std::min(rows, part.count - first),
                        part.width, part.stride, part.device + first * part.width});
  }
  if (pieces.empty()) return;
  const std::lock_guard<std::mutex> lock(mutex_);
  prepare_slots();
  // One core packs slower than the bus transfers; few pieces do not amortise the start of a thread.
  const std::size_t threads = std::min<std::size_t>(
      {kThreads, 1 + pieces.size() / 4, std::max(1u, std::thread::hardware_concurrency())});
  std::atomic<std::size_t> next{0};
  on_threads(threads, [&](std::size_t thread) {
    const DeviceScope scope(device);
    std::size_t turn = 0;
    for (std::size_t k = next++; k < pieces.size(); k = next++) {
      const std::size_t slot = thread * kSlots + turn++ % kSlots;
      float* staged = reinterpret_cast<float*>(slots_.data() + slot * kSlotBytes);
      check(cudaEventSynchronize(free_[slot]), "the upload of raw points");
      pack_rows(pieces[k], staged);
      check(cudaMemcpyAsync(pieces[k].device, staged,
                            pieces[k].count * pieces[k].width * sizeof(float),
                            cudaMemcpyHostToDevice, stream),
            "cudaMemcpyAsync of raw points");
      check(cudaEventRecord(free_[slot], stream), "cudaEventRecord");
    }
  });
}

}  // namespace gpureg::cuda
