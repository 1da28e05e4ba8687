// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <mutex>

#include "stage_data.hpp"

namespace gpureg::cuda {

/// What a PreparedCloud of the CUDA backend holds: facts on the host, and the arrays in the memory
/// of every device that has needed them, or in page-locked host memory once a memory budget has
/// driven them out. The arrays never change, so that all copies are the same. Thread-safe: the
/// engines of several devices share it.
class Fragment final : public PreparedState, public std::enable_shared_from_this<Fragment> {
 public:
  explicit Fragment(std::shared_ptr<const CudaCloud> made);

  std::size_t bytes() const { return bytes_; }
  /// The copy that lives on this device, or null. It stays alive as long as somebody holds it.
  std::shared_ptr<const CudaCloud> on(int device) const;
  bool in(const DeviceMemory& memory) const;

  /// Enqueues a copy into the exec's memory. Only after synchronize() it may be handed to keep(),
  /// which tells others of it.
  std::shared_ptr<const CudaCloud> start_copy(Exec& exec) const;
  void keep(const std::shared_ptr<const CudaCloud>& copy) const;
  /// Gives up the copy in this memory, after one to the host where it is the last. False where
  /// there is none.
  bool evict(const DeviceMemory& memory) const;

  std::vector<Vec3> copy_points() const override;
  std::vector<Vec3> copy_normals() const override;
  std::vector<float> copy_features() const override;

 private:
  std::shared_ptr<const CudaCloud> any() const;
  const CloudArrays& make_host_copy(const CudaCloud& from) const;

  std::size_t bytes_;
  mutable std::mutex mutex_;
  mutable std::vector<std::shared_ptr<const CudaCloud>> copies_;
  // once made it is kept: driving the fragment out again then costs nothing
  mutable PinnedBuffer host_;
  mutable CloudArrays host_arrays_;
};

}  // namespace gpureg::cuda
