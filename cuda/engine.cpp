// SPDX-License-Identifier: BSD-3-Clause
#include <mutex>
#include <string>

#include "gpureg/context.hpp"
#include "gpureg/error.hpp"
#include "pipeline/align.hpp"
#include "pipeline/prepare.hpp"
#include "stages.hpp"

namespace gpureg::cuda {
namespace {

/// Raw points that are prepared together: enough to fill the device, few enough for its memory and the staging.
constexpr std::size_t kRawPointsPerChunk = std::size_t(1) << 24;
constexpr std::size_t kCloudsPerChunk = 256;
constexpr std::size_t kPairsPerChunk = 256;
/// For one bit per hypothesis of every pair of a chunk.
constexpr std::size_t kSampleBytes = std::size_t(256) << 20;

/// Clouds of one device go with any context of that device.
const void* memory_of(int device) {
  static const char tokens[256] = {};
  return tokens + device % 256;
}

class CudaEngine final : public Engine {
 public:
  explicit CudaEngine(int device) : exec_(device) {
    cudaDeviceProp properties{};
    check(cudaGetDeviceProperties(&properties, device), "cudaGetDeviceProperties");
    description_ = "cuda:" + std::to_string(device) + ", " + properties.name;
  }

  Backend backend() const override { return Backend::cuda; }
  unsigned threads() const override { return 1; }
  std::string description() const override { return description_; }
  const void* memory() const override { return memory_of(exec_.device()); }
  std::size_t pairs_per_chunk(const RegistrationOptions& options) const override {
    const std::size_t fit = kSampleBytes / (options.hypothesis.count / 8 + 4096);
    return fit < 1 ? 1 : (fit < kPairsPerChunk ? fit : kPairsPerChunk);
  }

  std::vector<std::shared_ptr<PreparedState>> prepare(Span<const RawCloud> clouds, const PrepareOptions& options) override {
    std::lock_guard<std::mutex> lock(mutex_);
    const DeviceScope scope(exec_.device());
    std::vector<std::shared_ptr<PreparedState>> out;
    for (std::size_t begin = 0, end; begin < clouds.size; begin = end) {
      std::size_t points = clouds[begin].size;
      for (end = begin + 1; end < clouds.size && end - begin < kCloudsPerChunk && points + clouds[end].size <= kRawPointsPerChunk; ++end)
        points += clouds[end].size;
      exec_.begin();
      for (auto& cloud : pipeline::prepare(exec_, Span<const RawCloud>{clouds.data + begin, end - begin}, options)) {
        cloud->owner = memory();
        out.push_back(std::move(cloud));
      }
    }
    return out;
  }

  void align(Span<const PairInput> pairs, const RegistrationOptions& options, Span<PairOutcome> outcomes) override {
    std::lock_guard<std::mutex> lock(mutex_);
    const DeviceScope scope(exec_.device());
    exec_.begin();
    std::vector<PairView> views(pairs.size);
    for (std::size_t p = 0; p < pairs.size; ++p)
      views[p] = {static_cast<const CudaCloud*>(pairs[p].source)->view_on_device, static_cast<const CudaCloud*>(pairs[p].target)->view_on_device,
                  pairs[p].custom_source.data, pairs[p].custom_target.data, static_cast<std::uint32_t>(pairs[p].custom_source.size)};
    pipeline::align(exec_, span_of(views), options, outcomes);
  }

 private:
  std::mutex mutex_;
  Exec exec_;
  std::string description_;
};

/// Says what is there, or why nothing is.
int device_count(std::string& why_none) {
  int count = 0;
  const cudaError_t error = cudaGetDeviceCount(&count);
  if (error == cudaSuccess && count > 0) return count;
  cudaGetLastError();
  int driver = 0, runtime = 0;
  cudaDriverGetVersion(&driver);
  cudaRuntimeGetVersion(&runtime);
  const auto version = [](int v) { return std::to_string(v / 1000) + "." + std::to_string(v % 1000 / 10); };
  if (driver == 0)
    why_none = "no NVIDIA driver on this machine";
  else if (error == cudaErrorInsufficientDriver)
    why_none = "the NVIDIA driver supports CUDA " + version(driver) + ", this build needs " + version(runtime);
  else
    why_none = error == cudaSuccess ? "no CUDA device on this machine" : std::string(cudaGetErrorName(error)) + ", " + cudaGetErrorString(error);
  return 0;
}

}  // namespace
}  // namespace gpureg::cuda

namespace gpureg {

std::shared_ptr<Engine> make_cuda_engine(int device) {
  std::string why_none;
  const int count = cuda::device_count(why_none);
  if (count == 0) throw BackendUnavailable("cuda: " + why_none);
  if (device >= count)
    throw BackendUnavailable("cuda: device " + std::to_string(device) + " does not exist, this machine has " + std::to_string(count));
  return std::make_shared<cuda::CudaEngine>(device);
}

std::vector<std::string> describe_cuda_devices() {
  std::string why_none;
  const int count = cuda::device_count(why_none);
  if (count == 0) return {"cuda: " + why_none};
  std::vector<std::string> lines;
  for (int device = 0; device < count; ++device) {
    cudaDeviceProp p{};
    if (cudaGetDeviceProperties(&p, device) != cudaSuccess) continue;
    lines.push_back("cuda:" + std::to_string(device) + ", " + p.name + ", compute capability " + std::to_string(p.major) + "." +
                    std::to_string(p.minor) + ", " + std::to_string(p.totalGlobalMem >> 20) + " MiB");
  }
  return lines;
}

}  // namespace gpureg
