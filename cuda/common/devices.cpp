// SPDX-License-Identifier: BSD-3-Clause
#include <string>

#include "cuda/common/engine.hpp"
#include "gpureg/context.hpp"
#include "gpureg/error.hpp"

namespace gpureg {
namespace {

/// Describes the devices, or the reason why there is none.
int device_count(std::string& why_none) {
  int count = 0;
  const cudaError_t error = cudaGetDeviceCount(&count);
  if (error == cudaSuccess && count > 0) return count;
  cudaGetLastError();
  int driver = 0, runtime = 0;
  cudaDriverGetVersion(&driver);
  cudaRuntimeGetVersion(&runtime);
  why_none = cuda::why_no_device(error, driver, runtime);
  return 0;
}

}  // namespace

std::string cuda::why_no_device(cudaError_t error, int driver, int runtime) {
  const auto version = [](int v) {
    return std::to_string(v / 1000) + "." + std::to_string(v % 1000 / 10);
  };
  if (driver == 0) return "no NVIDIA driver on this machine";
  if (error == cudaErrorInsufficientDriver)
    return "the NVIDIA driver supports CUDA " + version(driver) + ", this build needs " +
           version(runtime);
  if (error == cudaSuccess || error == cudaErrorNoDevice) return "no CUDA device on this machine";
  return std::string(cudaGetErrorName(error)) + ", " + cudaGetErrorString(error);
}

std::shared_ptr<Engine> make_cuda_engine(const CudaOptions& options) {
  std::string why_none;
  const int count = device_count(why_none);
  if (count == 0) throw BackendUnavailable("cuda: " + why_none);
  std::vector<int> devices = options.devices;
  for (int device = 0; options.devices.empty() && device < count; ++device)
    devices.push_back(device);
  for (const int device : devices)
    if (device >= count)
      throw BackendUnavailable("cuda: device " + std::to_string(device) +
                               " does not exist, this machine has " + std::to_string(count));
  if (devices.size() == 1)
    return std::make_shared<cuda::CudaEngine>(devices[0], options.memory_budget);
  return cuda::make_engine_of_many(devices, options.memory_budget);
}

std::vector<std::string> describe_cuda_devices() {
  std::string why_none;
  const int count = device_count(why_none);
  if (count == 0) return {"cuda: " + why_none};
  std::vector<std::string> lines;
  for (int device = 0; device < count; ++device) {
    cudaDeviceProp p{};
    if (cudaGetDeviceProperties(&p, device) != cudaSuccess) continue;
    lines.push_back("cuda:" + std::to_string(device) + ", " + p.name + ", compute capability " +
                    std::to_string(p.major) + "." + std::to_string(p.minor) + ", " +
                    std::to_string(p.totalGlobalMem >> 20) + " MiB");
  }
  return lines;
}

}  // namespace gpureg
