// SPDX-License-Identifier: BSD-3-Clause
#include "cuda/device/exec.hpp"

namespace gpureg::cuda {

Exec::Exec(int device, std::shared_ptr<Uploader> uploader)
    : memory_(std::make_shared<DeviceMemory>(device)), uploader_(std::move(uploader)) {
  int shared = 0;
  check(cudaDeviceGetAttribute(&multiprocessors_, cudaDevAttrMultiProcessorCount, device),
        "cudaDeviceGetAttribute");
  check(cudaDeviceGetAttribute(&shared, cudaDevAttrMaxSharedMemoryPerBlockOptin, device),
        "cudaDeviceGetAttribute");
  shared_bytes_per_block_ = static_cast<std::size_t>(shared);
}

Exec::~Exec() {
  cudaStreamSynchronize(stream());
  for (cudaEvent_t event : events_) cudaEventDestroy(event);
}

int Exec::compiled_for(const void* kernel) const {
  cudaFuncAttributes attributes{};
  check(cudaFuncGetAttributes(&attributes, kernel), "cudaFuncGetAttributes");
  // binaryVersion is that of the translation, which has the device's architecture.
  return attributes.ptxVersion;
}

std::size_t Exec::allow_shared_memory(const void* kernel) {
  for (const auto& [known, bytes] : allowed_)
    if (known == kernel) return bytes;
  cudaFuncAttributes attributes{};
  check(cudaFuncGetAttributes(&attributes, kernel), "cudaFuncGetAttributes");
  const std::size_t bytes = shared_bytes_per_block_ > attributes.sharedSizeBytes
                                ? shared_bytes_per_block_ - attributes.sharedSizeBytes
                                : 0;
  check(cudaFuncSetAttribute(kernel, cudaFuncAttributeMaxDynamicSharedMemorySize,
                             static_cast<int>(bytes)),
        "cudaFuncSetAttribute");
  allowed_.emplace_back(kernel, bytes);
  return bytes;
}

void Exec::begin() {
  synchronize();
  memory_->free_reached();
  staging_.reset();
  events_used_ = 0;
}

void Exec::trim() {
  synchronize();
  staging_.clear();
  memory_->free_reached();
  // What the line before freed is free on the device from here on.
  synchronize();
  memory_->trim();
}

void Exec::synchronize() {
  check(cudaStreamSynchronize(stream()), "the work on the device");
  held_.clear();
}

Exec::Mark Exec::mark() {
  if (events_used_ == events_.size()) {
    cudaEvent_t event = nullptr;
    check(cudaEventCreate(&event), "cudaEventCreate");
    events_.push_back(event);
  }
  check(cudaEventRecord(events_[events_used_], stream()), "cudaEventRecord");
  return events_used_++;
}

double Exec::milliseconds(Mark from, Mark to) const {
  float ms = 0;
  check(cudaEventSynchronize(events_[to]), "the work on the device");
  check(cudaEventElapsedTime(&ms, events_[from], events_[to]), "cudaEventElapsedTime");
  return static_cast<double>(ms);
}

}  // namespace gpureg::cuda
