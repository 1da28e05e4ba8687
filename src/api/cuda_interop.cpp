// SPDX-License-Identifier: BSD-3-Clause
#include "gpureg/cuda_interop.hpp"

#include "pipeline/device_engine.hpp"

namespace gpureg {

std::future<PreparedCloud> prepare_async(const Context& context, const DevicePointCloudView& cloud,
                                         const PrepareOptions& options, CudaStream stream) {
  options.validate();
  cloud.validate();
  const std::shared_ptr<DeviceEngine> engine =
      std::dynamic_pointer_cast<DeviceEngine>(context.engine());
  if (!engine)
    throw InvalidArgument("clouds in device memory need a CUDA context, this one is " +
                          context.description());
  const RawCloud raw{cloud.points,
                     cloud.size,
                     cloud.point_stride,
                     cloud.normals,
                     cloud.normal_stride,
                     cloud.features,
                     cloud.feature_dimension,
                     cloud.feature_stride ? cloud.feature_stride : cloud.feature_dimension,
                     cloud.viewpoints,
                     cloud.viewpoint_count};
  const std::shared_ptr<AdoptedCloud> adopted = engine->adopt(raw, stream);
  return std::async(std::launch::async, [engine, adopted, options] {
    return PreparedCloud(engine->prepare_adopted(*adopted, options));
  });
}

}  // namespace gpureg
