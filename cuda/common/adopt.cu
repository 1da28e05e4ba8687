// SPDX-License-Identifier: BSD-3-Clause
#include <string>

#include "cuda/common/engine.hpp"
#include "cuda/device/launch.cuh"
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

void CudaEngine::check_on_host(const RawCloud& cloud) const {
  const DeviceScope scope(device());
  const std::pair<const char*, const float*> fields[] = {{"cloud.points", cloud.points},
                                                         {"cloud.normals", cloud.normals},
                                                         {"cloud.features", cloud.features}};
  for (const auto& [field, pointer] : fields) {
    cudaPointerAttributes attributes{};
    const bool known = pointer && cudaPointerGetAttributes(&attributes, pointer) == cudaSuccess;
    if (pointer && !known) cudaGetLastError();
    // The host can read managed memory.
    if (known && attributes.type == cudaMemoryTypeDevice)
      throw InvalidArgument(std::string(field) + " is memory of device " +
                            std::to_string(attributes.device) +
                            ", expected host memory: give a DevicePointCloudView and the stream "
                            "that wrote it");
  }
}

namespace {

/// Rows of a cloud with tight copies in memory of the engine.
struct Part {
  const char* field;
  const float* from;
  std::size_t stride;
  unsigned width;
  cudaStream_t stream;
  float* to = nullptr;
  std::size_t bytes = 0;
  cudaEvent_t written = nullptr;
};

/// Copies of a cloud's rows, each written in the order of its stream of the program.
class Adopted final : public AdoptedCloud {
 public:
  Adopted(std::shared_ptr<DeviceMemory> memory, const RawCloud& cloud, const RowStreams& streams);
  ~Adopted() override {
    for (const Part& part : parts_)
      if (part.written)
        memory_->free_after(part.to, part.bytes, part.written);
      else if (part.to)
        memory_->free(part.to, part.bytes);
  }
  void take();

  int device() const { return memory_->device(); }
  void wait() const {
    for (const Part& part : parts_)
      if (part.written) check(cudaEventSynchronize(part.written), "the copy of the cloud");
  }
  /// Tight rows on the device, complete after wait().
  RawCloud raw;

 private:
  std::vector<float> viewpoints_;
  std::shared_ptr<DeviceMemory> memory_;
  Part parts_[3];
};

__global__ void pack_rows(const float* from, std::size_t stride, unsigned width, std::size_t size,
                          float* to) {
  const std::size_t k = static_cast<std::size_t>(blockIdx.x) * blockDim.x + threadIdx.x;
  if (k < size * width) to[k] = from[k / width * stride + k % width];
}

Adopted::Adopted(std::shared_ptr<DeviceMemory> memory, const RawCloud& cloud,
                 const RowStreams& streams)
    : raw(cloud),
      memory_(std::move(memory)),
      parts_{{"cloud.points", cloud.points, cloud.point_stride, 3,
              static_cast<cudaStream_t>(streams.points)},
             {"cloud.normals", cloud.normals, cloud.normal_stride, 3,
              static_cast<cudaStream_t>(streams.normals)},
             {"cloud.features", cloud.features, cloud.feature_stride,
              static_cast<unsigned>(cloud.feature_dimension),
              static_cast<cudaStream_t>(streams.features)}} {
  if (cloud.viewpoint_count > 0)
    viewpoints_.assign(cloud.viewpoints, cloud.viewpoints + 3 * cloud.viewpoint_count);
  raw.viewpoints = viewpoints_.data();
  raw.on_device = true;
  for (const Part& part : parts_) {
    if (!part.from) continue;
    const int found = device_of(part.from);
    if (found < 0) throw InvalidArgument(std::string(part.field) + " is not device memory");
    if (found != device())
      throw InvalidArgument(std::string(part.field) + " lies on device " + std::to_string(found) +
                            ", but the context works on device " + std::to_string(device()));
  }
}

void Adopted::take() {
  for (Part& part : parts_) {
    const std::size_t floats = part.from ? raw.size * part.width : 0;
    if (floats == 0) continue;
    part.bytes = floats * sizeof(float);
    part.to = static_cast<float*>(memory_->allocate(part.bytes, part.stream));
    launch(part.stream, "pack_rows", pack_rows, shape_for(floats, 256), part.from, part.stride,
           part.width, raw.size, part.to);
    // A thread that waits for it sleeps.
    check(cudaEventCreateWithFlags(&part.written, cudaEventDisableTiming | cudaEventBlockingSync),
          "cudaEventCreateWithFlags");
    check(cudaEventRecord(part.written, part.stream), "cudaEventRecord");
  }
  raw.points = parts_[0].to;
  raw.point_stride = 3;
  raw.normals = parts_[1].to;
  raw.normal_stride = 3;
  raw.features = parts_[2].to;
  raw.feature_stride = raw.feature_dimension;
}

}  // namespace

// Without the lock of the engine: the program must not wait for a running batch.
std::shared_ptr<AdoptedCloud> CudaEngine::adopt(const RawCloud& cloud, const RowStreams& streams) {
  const DeviceScope scope(device());
  const auto adopted = std::make_shared<Adopted>(lanes_.exec(0).memory(), cloud, streams);
  adopted->take();
  return adopted;
}

// Waits for the program's streams on this thread alone: neither the lock nor the stream of the
// engine may depend on them, as other calls need both. The preparation reads the rows on the
// device, without a copy.
std::vector<std::shared_ptr<PreparedState>> CudaEngine::prepare_adopted(
    Span<const std::shared_ptr<AdoptedCloud>> clouds, const PrepareSettings& options) {
  std::vector<RawCloud> raw;
  for (const std::shared_ptr<AdoptedCloud>& cloud : clouds) {
    const Adopted& adopted = static_cast<const Adopted&>(*cloud);
    adopted.wait();
    raw.push_back(adopted.raw);
  }
  return prepare(span_of(raw), options);
}

std::vector<float> CudaEngine::copy_points(const AdoptedCloud& cloud) {
  const DeviceScope scope(device());
  const Adopted& adopted = static_cast<const Adopted&>(cloud);
  std::vector<float> rows(3 * adopted.raw.size);
  if (rows.empty()) return rows;
  adopted.wait();
  const Lanes::Held held = lanes_.any();
  cudaStream_t stream = held.exec().stream();
  check(cudaMemcpyAsync(rows.data(), adopted.raw.points, rows.size() * sizeof(float),
                        cudaMemcpyDeviceToHost, stream),
        "cudaMemcpyAsync");
  check(cudaStreamSynchronize(stream), "cudaStreamSynchronize");
  return rows;
}

void load_adoption() {
  cudaFuncAttributes attributes{};
  check(cudaFuncGetAttributes(&attributes, pack_rows), "cudaFuncGetAttributes");
}

int device_of(const AdoptedCloud& cloud) { return static_cast<const Adopted&>(cloud).device(); }

}  // namespace gpureg::cuda
