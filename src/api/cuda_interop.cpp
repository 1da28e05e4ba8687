// SPDX-License-Identifier: BSD-3-Clause
#include "gpureg/cuda_interop.hpp"

#include "api/access.hpp"
#include "api/raw_cloud.hpp"
#include "pipeline/device_engine.hpp"

namespace gpureg {

std::future<PreparedCloud> prepare_async(const Context& context, const DevicePointCloudView& cloud,
                                         const PrepareOptions& options, CudaStream stream) {
  options.validate();
  const RawCloud raw = raw_cloud(cloud);
  const std::shared_ptr<DeviceEngine> engine =
      std::dynamic_pointer_cast<DeviceEngine>(Access::engine(context));
  if (!engine)
    throw InvalidArgument("clouds in device memory need a CUDA context, this one is " +
                          context.description());
  const std::shared_ptr<AdoptedCloud> adopted = engine->adopt(raw, stream);
  return std::async(std::launch::async, [engine, adopted, options] {
    return Access::cloud(engine->prepare_adopted(*adopted, options));
  });
}

}  // namespace gpureg
