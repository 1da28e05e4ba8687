// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <mutex>

#include "cuda/common/stage_data.hpp"

namespace gpureg::cuda {

/// Data of a PreparedCloud of the CUDA backend: metadata on the host, and the arrays in the memory
/// of every device that has needed them, or in page-locked host memory after an eviction under the
/// memory budget. The arrays never change, so all copies are equal. Thread-safe: the engines of
/// several devices share it.
class PreparedCloud final : public PreparedState,
                            public std::enable_shared_from_this<PreparedCloud> {
 public:
  explicit PreparedCloud(std::shared_ptr<const CudaCloud> made);

  std::size_t bytes() const { return bytes_; }
  /// The copy on this device, or null. It stays alive while a reference is held.
  std::shared_ptr<const CudaCloud> on(int device) const;
  bool in(const DeviceMemory& memory) const;

  /// Enqueues a copy into the memory of exec. After synchronize() the copy may go to keep(), which
  /// makes it visible to other threads.
  std::shared_ptr<const CudaCloud> start_copy(Exec& exec) const;
  void keep(const std::shared_ptr<const CudaCloud>& copy) const;
  /// Releases the copy in this memory, after a copy to the host where it is the last one. False
  /// where there is none.
  bool evict(const DeviceMemory& memory) const;

  std::vector<Vec3> copy_points() const override;
  std::vector<Vec3> copy_normals() const override;
  std::vector<float> copy_features() const override;
  PointsAndNormals copy_points_and_normals() const override;

 private:
  std::shared_ptr<const CudaCloud> any() const;
  const CloudArrays& make_host_copy(const CudaCloud& from) const;

  std::size_t bytes_;
  mutable std::mutex mutex_;
  mutable std::vector<std::shared_ptr<const CudaCloud>> copies_;
  // Kept once made, so that the next eviction is free.
  mutable PinnedBuffer host_;
  mutable CloudArrays host_arrays_;
};

}  // namespace gpureg::cuda
