// SPDX-License-Identifier: BSD-3-Clause
#include "cuda/common/prepared_cloud.hpp"

#include <algorithm>

#include "cuda/common/nearest_feature.hpp"

namespace gpureg::cuda {
namespace {

/// Synchronised data: any stream may read it, and this stream waits for no other.
void copy_to_host(char* host, const CudaCloud& from, std::size_t bytes) {
  if (bytes == 0) return;
  const DeviceScope scope(from.data.memory()->device());
  cudaStream_t stream = nullptr;
  check(cudaStreamCreateWithFlags(&stream, cudaStreamNonBlocking), "cudaStreamCreateWithFlags");
  cudaError_t error =
      cudaMemcpyAsync(host, from.data.data(), bytes, cudaMemcpyDeviceToHost, stream);
  if (error == cudaSuccess) error = cudaStreamSynchronize(stream);
  cudaStreamDestroy(stream);
  check(error, "copying a cloud to the host");
}

template <typename T>
std::vector<T> copied(const T* host, std::size_t size) {
  return std::vector<T>(host, host + size);
}

}  // namespace

CloudArrays CloudArrays::moved(const char* from, char* to) const {
  CloudArrays out = *this;
  const auto move = [&](auto*& pointer) {
    if (!pointer) return;
    using Pointer = std::remove_reference_t<decltype(pointer)>;
    pointer = reinterpret_cast<Pointer>(to + (reinterpret_cast<const char*>(pointer) - from));
  };
  CloudView& v = out.view_on_device;
  move(v.points);
  move(v.normals);
  move(v.features);
  move(v.has_feature);
  move(v.closest.table.data);
  move(v.closest.cell_start.data);
  move(v.closest.candidates.data);
  CellSummaries& s = out.summaries;
  move(s.run);
  move(s.brick);
  move(s.cell);
  move(s.block);
  move(s.positions);
  move(s.near);
  move(s.near_index);
  move(out.order.point);
  move(out.order.normal);
  move(out.order.index);
  move(v.wide_features);
  move(v.has_wide_feature);
  move(v.normal_weight);
  move(v.visibility.depth);
  move(v.visibility.viewpoints);
  move(v.surface_sides.words);
  for (FeatureAids* aids : {&out.narrow_aids, &out.wide_aids}) {
    move(aids->half);
    move(aids->square);
    move(aids->error);
    move(aids->scale);
  }
  return out;
}

PreparedCloud::PreparedCloud(std::shared_ptr<const CudaCloud> made)
    : PreparedState(*made), bytes_(made->data.size()), copies_{std::move(made)} {}

std::shared_ptr<const CudaCloud> PreparedCloud::on(int device) const {
  const std::lock_guard<std::mutex> lock(mutex_);
  for (const auto& copy : copies_)
    // A cloud without arrays is on every device.
    if (!copy->data.memory() || copy->data.memory()->device() == device) return copy;
  return nullptr;
}

bool PreparedCloud::in(const DeviceMemory& memory) const {
  const std::lock_guard<std::mutex> lock(mutex_);
  return std::any_of(copies_.begin(), copies_.end(),
                     [&](const auto& copy) { return copy->data.memory().get() == &memory; });
}

std::shared_ptr<const CudaCloud> PreparedCloud::any() const {
  const std::lock_guard<std::mutex> lock(mutex_);
  return copies_.empty() ? nullptr : copies_.front();
}

const CloudArrays& PreparedCloud::make_host_copy(const CudaCloud& from) const {
  if (host_.data()) return host_arrays_;
  PinnedBuffer host(bytes_);
  copy_to_host(host.data(), from, bytes_);
  host_ = std::move(host);
  host_arrays_ = from.moved(from.data.data(), host_.data());
  return host_arrays_;
}

std::shared_ptr<const CudaCloud> PreparedCloud::start_copy(Exec& exec) const {
  auto out = std::make_shared<CudaCloud>();
  static_cast<PreparedState&>(*out) = *this;
  out->data = exec.buffer<char>(bytes_);
  const CloudArrays* arrays = nullptr;
  const char* from = nullptr;
  const std::shared_ptr<const CudaCloud> other = any();
  if (other) {
    // Between devices, possibly through staging memory of the driver.
    const int other_device = other->data.memory() ? other->data.memory()->device() : exec.device();
    const cudaError_t error =
        bytes_ == 0 ? cudaSuccess
                    : cudaMemcpyPeerAsync(out->data.data(), exec.device(), other->data.data(),
                                          other_device, bytes_, exec.stream());
    if (error == cudaSuccess) {
      exec.hold(other);
      arrays = other.get();
      from = other->data.data();
    } else {
      cudaGetLastError();
    }
  }
  if (!arrays) {
    const std::lock_guard<std::mutex> lock(mutex_);
    arrays = other ? &make_host_copy(*other) : &host_arrays_;
    from = host_.data();
    if (bytes_ > 0)
      check(cudaMemcpyAsync(out->data.data(), from, bytes_, cudaMemcpyHostToDevice, exec.stream()),
            "copying a cloud to the device");
  }
  static_cast<CloudArrays&>(*out) = arrays->moved(from, out->data.data());
  out->view_on_device.executor_data = out.get();
  return out;
}

void PreparedCloud::keep(const std::shared_ptr<const CudaCloud>& copy) const {
  const std::lock_guard<std::mutex> lock(mutex_);
  copies_.push_back(copy);
}

bool PreparedCloud::evict(const DeviceMemory& memory) const {
  const std::lock_guard<std::mutex> lock(mutex_);
  for (auto copy = copies_.begin(); copy != copies_.end(); ++copy) {
    if ((*copy)->data.memory().get() != &memory) continue;
    if (copies_.size() == 1) make_host_copy(**copy);
    copies_.erase(copy);
    return true;
  }
  return false;
}

// Without a copy on a device there is one on the host.
std::vector<Vec3> PreparedCloud::copy_points() const {
  const auto copy = any();
  return copy ? copy->copy_points() : copied(host_arrays_.view_on_device.points, size);
}
std::vector<Vec3> PreparedCloud::copy_normals() const {
  const auto copy = any();
  return copy ? copy->copy_normals() : copied(host_arrays_.view_on_device.normals, size);
}
PointsAndNormals PreparedCloud::copy_points_and_normals() const {
  if (const auto copy = any()) return copy->copy_points_and_normals();
  return {copied(host_arrays_.view_on_device.points, size),
          copied(host_arrays_.view_on_device.normals, size)};
}
std::vector<float> PreparedCloud::copy_features() const {
  const auto copy = any();
  return copy ? copy->copy_features()
              : tight_rows(copied(host_arrays_.view_on_device.features,
                                  std::size_t(size) * row_stride(feature_dimension)),
                           feature_dimension);
}

}  // namespace gpureg::cuda
