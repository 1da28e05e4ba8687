// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <cub/device/device_scan.cuh>
#include <cub/device/device_select.cuh>
#include <stdexcept>
#include <string>

#include "surfel_map.hpp"

namespace surfel {
namespace {

void check(cudaError_t status, const char* what) {
  if (status != cudaSuccess)
    throw std::runtime_error(std::string("surfels on CUDA: ") + what + ": " +
                             cudaGetErrorString(status));
}

/// Device memory that grows; what is in it stays where asked.
template <class T>
class Buffer {
 public:
  Buffer() = default;
  Buffer(const Buffer&) = delete;
  Buffer& operator=(const Buffer&) = delete;
  ~Buffer() { cudaFree(data_); }
  T* data() const { return data_; }
  void reserve(std::size_t size, std::size_t keep = 0) {
    if (size <= capacity_) return;
    T* larger = nullptr;
    const std::size_t capacity = std::max(size, 2 * capacity_);
    check(cudaMalloc(&larger, capacity * sizeof(T)), "cudaMalloc");
    if (keep > 0)
      check(cudaMemcpy(larger, data_, keep * sizeof(T), cudaMemcpyDeviceToDevice), "copy");
    cudaFree(data_);
    data_ = larger;
    capacity_ = capacity;
  }
  void swap(Buffer& other) {
    std::swap(data_, other.data_);
    std::swap(capacity_, other.capacity_);
  }

 private:
  T* data_ = nullptr;
  std::size_t capacity_ = 0;
};

constexpr int kBlock = 256;
unsigned blocks(std::size_t count) { return static_cast<unsigned>((count + kBlock - 1) / kBlock); }
__device__ unsigned here() { return blockIdx.x * blockDim.x + threadIdx.x; }

__global__ void index_surfels(Frame frame, const Surfel* surfels, unsigned count, int since,
                              unsigned long long* cells) {
  const unsigned k = here();
  if (k >= count || surfels[k].last < since) return;
  float z;
  const int cell = cell_of(frame, surfels[k], z);
  if (cell >= 0) atomicMin(&cells[cell], index_key(z, k));
}

__global__ void decide(Frame frame, const unsigned long long* cells, const Surfel* surfels,
                       int columns, unsigned count, Fate* fates, unsigned* births) {
  const unsigned cell = here();
  if (cell >= count) return;
  const int column = static_cast<int>(cell) % columns, row = static_cast<int>(cell) / columns;
  Measured m;
  const Fate fate = measure(frame, column * frame.stride, row * frame.stride, m)
                        ? fate_of(frame, m, cells, surfels, column, row)
                        : Fate::nothing;
  fates[cell] = fate;
  births[cell] = fate == Fate::birth ? 1 : 0;
}

__global__ void apply(Frame frame, const unsigned long long* cells, const Fate* fates,
                      const unsigned* places, int columns, unsigned count, unsigned size,
                      Surfel* surfels) {
  const unsigned cell = here();
  if (cell >= count || fates[cell] == Fate::nothing) return;
  const int u = static_cast<int>(cell) % columns * frame.stride,
            v = static_cast<int>(cell) / columns * frame.stride;
  Measured m;
  measure(frame, u, v, m);
  if (fates[cell] == Fate::update)
    update(frame, m, u, v, surfels[static_cast<std::uint32_t>(cells[cell])]);
  else
    surfels[size + places[cell]] = born(frame, m, u, v);
}

__global__ void correct_all(Surfel* surfels, unsigned count, const int* frames, const int* sessions,
                            const MotionSum* sums, int keyframes) {
  const unsigned k = here();
  if (k < count) correct(surfels[k], frames, sessions, sums, keyframes);
}

struct Stays {
  int frame;
  Options options;
  __host__ __device__ bool operator()(const Surfel& s) const { return stays(s, frame, options); }
};

class CudaMap : public SurfelMap {
 public:
  explicit CudaMap(const Options& options) : options_(options) {
    check(cudaStreamCreateWithFlags(&stream_, cudaStreamNonBlocking), "cudaStreamCreate");
  }
  ~CudaMap() override { cudaStreamDestroy(stream_); }

  void fuse(const Image& image, const Camera& camera, const Pose& pose, int number,
            int since) override {
    const std::size_t pixels = static_cast<std::size_t>(image.width) * image.height;
    const int columns = image.width / options_.stride, rows = image.height / options_.stride;
    const auto count = static_cast<unsigned>(columns * rows);
    depth_.reserve(pixels);
    colour_.reserve(3 * pixels);
    cells_.reserve(count);
    fates_.reserve(count);
    births_.reserve(count);
    places_.reserve(count + 1);
    surfels_.reserve(size_ + count, size_);
    copy_in(depth_.data(), image.depth, pixels);
    if (image.colour != nullptr) copy_in(colour_.data(), image.colour, 3 * pixels);
    const Frame frame{depth_.data(), image.colour != nullptr ? colour_.data() : nullptr,
                      image.width,   image.height,
                      camera,        pose,
                      number,        options_.stride};
    check(cudaMemsetAsync(cells_.data(), 0xFF, count * sizeof(unsigned long long), stream_),
          "clear");
    if (size_ > 0)
      index_surfels<<<blocks(size_), kBlock, 0, stream_>>>(
          frame, surfels_.data(), static_cast<unsigned>(size_),
          std::max(since, number - options_.active_frames), cells_.data());
    decide<<<blocks(count), kBlock, 0, stream_>>>(frame, cells_.data(), surfels_.data(), columns,
                                                  count, fates_.data(), births_.data());
    std::size_t bytes = 0;
    check(cub::DeviceScan::ExclusiveSum(nullptr, bytes, births_.data(), places_.data(), count,
                                        stream_),
          "scan");
    scratch_.reserve(bytes);
    check(cub::DeviceScan::ExclusiveSum(scratch_.data(), bytes, births_.data(), places_.data(),
                                        count, stream_),
          "scan");
    apply<<<blocks(count), kBlock, 0, stream_>>>(frame, cells_.data(), fates_.data(),
                                                 places_.data(), columns, count,
                                                 static_cast<unsigned>(size_), surfels_.data());
    unsigned last = 0, place = 0;
    copy_out(&last, births_.data() + count - 1, 1);
    copy_out(&place, places_.data() + count - 1, 1);
    wait();
    size_ += last + place;
    if (++fused_ % kCleanEvery == 0) clean(number);
  }

  void correct(const std::vector<Correction>& corrections) override {
    if (corrections.empty() || size_ == 0) return;
    const Motions motions(corrections);
    const std::size_t count = motions.frames.size();
    frames_.reserve(count);
    sessions_.reserve(count);
    sums_.reserve(count + 1);
    copy_in(frames_.data(), motions.frames.data(), count);
    copy_in(sessions_.data(), motions.sessions.data(), count);
    copy_in(sums_.data(), motions.sums.data(), count + 1);
    correct_all<<<blocks(size_), kBlock, 0, stream_>>>(
        surfels_.data(), static_cast<unsigned>(size_), frames_.data(), sessions_.data(),
        sums_.data(), static_cast<int>(count));
    wait();
  }

  Cloud download() const override {
    Cloud result(size_);
    check(
        cudaMemcpy(result.data(), surfels_.data(), size_ * sizeof(Surfel), cudaMemcpyDeviceToHost),
        "download");
    return result;
  }

  void upload(const Cloud& surfels) override {
    size_ = surfels.size();
    surfels_.reserve(size_);
    check(
        cudaMemcpy(surfels_.data(), surfels.data(), size_ * sizeof(Surfel), cudaMemcpyHostToDevice),
        "upload");
  }

  std::size_t size() const override { return size_; }

 private:
  template <class T>
  void copy_in(T* to, const T* from, std::size_t count) {
    check(cudaMemcpyAsync(to, from, count * sizeof(T), cudaMemcpyHostToDevice, stream_), "copy");
  }
  template <class T>
  void copy_out(T* to, const T* from, std::size_t count) {
    check(cudaMemcpyAsync(to, from, count * sizeof(T), cudaMemcpyDeviceToHost, stream_), "copy");
  }
  void wait() {
    check(cudaGetLastError(), "launch");
    check(cudaStreamSynchronize(stream_), "kernel");
  }

  /// Keeps the order: CUB's selection is stable.
  void clean(int frame) {
    if (size_ == 0) return;
    kept_.reserve(size_);
    places_.reserve(1);
    const Stays stays_now{frame, options_};
    std::size_t bytes = 0;
    const int count = static_cast<int>(size_);
    check(cub::DeviceSelect::If(nullptr, bytes, surfels_.data(), kept_.data(), places_.data(),
                                count, stays_now, stream_),
          "select");
    scratch_.reserve(bytes);
    check(cub::DeviceSelect::If(scratch_.data(), bytes, surfels_.data(), kept_.data(),
                                places_.data(), count, stays_now, stream_),
          "select");
    unsigned kept = 0;
    copy_out(&kept, places_.data(), 1);
    wait();
    size_ = kept;
    surfels_.swap(kept_);
  }

  const Options options_;
  cudaStream_t stream_ = nullptr;
  std::size_t size_ = 0;
  int fused_ = 0;
  Buffer<Surfel> surfels_, kept_;
  Buffer<float> depth_;
  Buffer<std::uint8_t> colour_;
  Buffer<unsigned long long> cells_;
  Buffer<Fate> fates_;
  Buffer<unsigned> births_, places_;
  Buffer<char> scratch_;
  Buffer<int> frames_, sessions_;
  Buffer<MotionSum> sums_;
};

}  // namespace

bool cuda_available() {
  int count = 0;
  return cudaGetDeviceCount(&count) == cudaSuccess && count > 0;
}

std::unique_ptr<SurfelMap> make_cuda_map(const Options& options) {
  if (!cuda_available()) throw std::runtime_error("surfels on CUDA: there is no device");
  return std::make_unique<CudaMap>(options);
}

}  // namespace surfel
