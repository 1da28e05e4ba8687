// SPDX-License-Identifier: BSD-3-Clause
#include "exec.hpp"

namespace gpureg::cuda {

Exec::Exec(int device) : memory_(std::make_shared<DeviceMemory>(device)) {
  int shared = 0;
  check(cudaDeviceGetAttribute(&multiprocessors_, cudaDevAttrMultiProcessorCount, device),
        "cudaDeviceGetAttribute");
  check(cudaDeviceGetAttribute(&shared, cudaDevAttrMaxSharedMemoryPerBlockOptin, device),
        "cudaDeviceGetAttribute");
  shared_bytes_per_block_ = static_cast<std::size_t>(shared);
  int major = 0, minor = 0;
  check(cudaDeviceGetAttribute(&major, cudaDevAttrComputeCapabilityMajor, device),
        "cudaDeviceGetAttribute");
  check(cudaDeviceGetAttribute(&minor, cudaDevAttrComputeCapabilityMinor, device),
        "cudaDeviceGetAttribute");
  compute_capability_ = 10 * major + minor;
}

Exec::~Exec() {
  cudaStreamSynchronize(stream());
  for (cudaEvent_t event : events_) cudaEventDestroy(event);
}

void Exec::begin() {
  synchronize();
  staging_.reset();
  events_used_ = 0;
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
