// SPDX-License-Identifier: BSD-3-Clause
// Stands in for cuda/ in builds without a CUDA compiler.
#include "gpureg/cuda_interop.hpp"
#include "pipeline/device_engine.hpp"

namespace gpureg {

namespace {
constexpr char kNotBuilt[] =
    "this build of gpureg has no CUDA backend (configure with -DGPUREG_CUDA=ON)";
}

std::shared_ptr<Engine> make_cuda_engine(const CudaOptions&) {
  throw BackendUnavailable(kNotBuilt);
}

std::vector<std::string> describe_cuda_devices() { return {"cuda: not in this build"}; }

std::future<PreparedCloud> prepare_async(const Context& context, const DevicePointCloudView& cloud,
                                         const RegistrationOptions& options, CudaStream) {
  options.validate();
  cloud.validate();
  throw InvalidArgument("clouds in device memory need a CUDA context, this one is " +
                        context.description());
}

std::future<std::vector<PreparedCloud>> prepare_batch_async(
    const Context& context, const std::vector<DevicePointCloudView>& clouds,
    const RegistrationOptions& options, const std::vector<CudaStream>&,
    const std::vector<std::string>&) {
  options.validate();
  for (const DevicePointCloudView& cloud : clouds) cloud.validate();
  throw InvalidArgument("clouds in device memory need a CUDA context, this one is " +
                        context.description());
}

}  // namespace gpureg
