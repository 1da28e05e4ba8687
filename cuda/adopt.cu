// SPDX-License-Identifier: BSD-3-Clause
#include <string>

#include "engine.hpp"
#include "gpureg/error.hpp"

namespace gpureg::cuda {

int device_of(const void* pointer) {
  cudaPointerAttributes attributes{};
  const bool known = cudaPointerGetAttributes(&attributes, pointer) == cudaSuccess;
  if (!known) cudaGetLastError();
  return known && (attributes.type == cudaMemoryTypeDevice ||
                   attributes.type == cudaMemoryTypeManaged)
             ? attributes.device
             : -1;
}

namespace {

/// Copy of a cloud with tight rows, in memory of the engine; written and freed in the order of the
/// program's stream.
class Adopted final : public AdoptedCloud {
 public:
  explicit Adopted(std::shared_ptr<DeviceMemory> memory) : memory_(std::move(memory)) {}
  ~Adopted() override {
    // Frees the rows in the order of the engine's stream, after their event, as that stream may
    // never have waited for them.
    if (event_) {
      cudaStreamWaitEvent(memory_->stream(), event_, 0);
      cudaEventDestroy(event_);
    }
    if (rows_) memory_->free(rows_, bytes_);
  }
  void take(const RawCloud& cloud, cudaStream_t stream);

  int device() const { return memory_->device(); }
  /// Tight rows on the device, complete once the event is reached.
  RawCloud raw{};
  cudaEvent_t event() const { return event_; }

 private:
  std::vector<float> viewpoints_;
  std::shared_ptr<DeviceMemory> memory_;
  float* rows_ = nullptr;
  std::size_t bytes_ = 0;
  cudaEvent_t event_ = nullptr;
};

struct Rows {
  const float* from;
  std::size_t stride;
  unsigned width;
  float* to;
};

__global__ void pack_rows(Rows rows, std::size_t size) {
  const std::size_t k = static_cast<std::size_t>(blockIdx.x) * blockDim.x + threadIdx.x;
  if (k < size * rows.width) rows.to[k] = rows.from[k / rows.width * rows.stride + k % rows.width];
}

void check_place(const char* field, const float* pointer, int device) {
  if (!pointer) return;
  const int found = device_of(pointer);
  if (found < 0) throw InvalidArgument(std::string(field) + " is not device memory");
  if (found != device)
    throw InvalidArgument(std::string(field) + " lies on device " + std::to_string(found) +
                          ", but the context works on device " + std::to_string(device));
}

void Adopted::take(const RawCloud& cloud, cudaStream_t stream) {
  raw = cloud;
  if (cloud.viewpoint_count > 0)
    viewpoints_.assign(cloud.viewpoints, cloud.viewpoints + 3 * cloud.viewpoint_count);
  raw.viewpoints = viewpoints_.data();
  Rows parts[3] = {{cloud.points, cloud.point_stride, 3, nullptr},
                   {cloud.normals, cloud.normal_stride, 3, nullptr},
                   {cloud.features, cloud.feature_stride,
                    static_cast<unsigned>(cloud.feature_dimension), nullptr}};
  std::size_t floats = 0;
  for (const Rows& part : parts) floats += part.from ? cloud.size * part.width : 0;
  if (floats > 0) rows_ = static_cast<float*>(memory_->allocate(floats * sizeof(float), stream));
  bytes_ = floats * sizeof(float);
  float* at = rows_;
  for (Rows& part : parts) {
    if (!part.from || cloud.size == 0) continue;
    part.to = at;
    at += cloud.size * part.width;
    pack_rows<<<blocks_for(cloud.size * part.width, 256), 256, 0, stream>>>(part, cloud.size);
    check_launch("pack_rows");
  }
  raw.points = parts[0].to;
  raw.point_stride = 3;
  raw.normals = parts[1].to;
  raw.normal_stride = 3;
  raw.features = parts[2].to;
  raw.feature_stride = cloud.feature_dimension;
  check(cudaEventCreateWithFlags(&event_, cudaEventDisableTiming), "cudaEventCreateWithFlags");
  check(cudaEventRecord(event_, stream), "cudaEventRecord");
}

}  // namespace

// Without the lock of the engine: the program must not wait for a running batch.
std::shared_ptr<AdoptedCloud> CudaEngine::adopt(const RawCloud& cloud, void* stream) {
  const DeviceScope scope(device());
  check_place("cloud.points", cloud.points, device());
  check_place("cloud.normals", cloud.normals, device());
  check_place("cloud.features", cloud.features, device());
  const auto adopted = std::make_shared<Adopted>(exec_.memory());
  adopted->take(cloud, static_cast<cudaStream_t>(stream));
  return adopted;
}

// The preparation reads the rows on the device, without a copy.
std::shared_ptr<PreparedState> CudaEngine::prepare_adopted(const AdoptedCloud& cloud,
                                                           const PrepareOptions& options) {
  const std::lock_guard<std::mutex> lock(mutex_);
  const DeviceScope scope(device());
  const Adopted& adopted = static_cast<const Adopted&>(cloud);
  check(cudaStreamWaitEvent(exec_.stream(), adopted.event(), 0), "cudaStreamWaitEvent");
  return prepare_on_stream({&adopted.raw, 1}, options).front();
}

std::vector<float> CudaEngine::copy_points(const AdoptedCloud& cloud) {
  const std::lock_guard<std::mutex> lock(mutex_);
  const DeviceScope scope(device());
  const Adopted& adopted = static_cast<const Adopted&>(cloud);
  std::vector<float> rows(3 * adopted.raw.size);
  if (rows.empty()) return rows;
  check(cudaStreamWaitEvent(exec_.stream(), adopted.event(), 0), "cudaStreamWaitEvent");
  check(cudaMemcpyAsync(rows.data(), adopted.raw.points, rows.size() * sizeof(float),
                        cudaMemcpyDeviceToHost, exec_.stream()),
        "cudaMemcpyAsync");
  check(cudaStreamSynchronize(exec_.stream()), "cudaStreamSynchronize");
  return rows;
}

int device_of(const AdoptedCloud& cloud) { return static_cast<const Adopted&>(cloud).device(); }

}  // namespace gpureg::cuda
