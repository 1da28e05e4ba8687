// SPDX-License-Identifier: BSD-3-Clause
#include "gpureg/cuda_interop.hpp"

#include <algorithm>
#include <array>

#include "api/access.hpp"
#include "api/raw_cloud.hpp"
#include "pipeline/device_engine.hpp"

namespace gpureg {

std::future<PreparedCloud> prepare_async(const Context& context, const DevicePointCloudView& cloud,
                                         const PrepareOptions& options, CudaStream stream) {
  options.validate();
  RawCloud raw = raw_cloud(cloud);
  FrameOrigin frame_origin;
  view_from_frame_origin(cloud.origin, frame_origin, raw);
  const std::shared_ptr<DeviceEngine> engine =
      std::dynamic_pointer_cast<DeviceEngine>(Access::engine(context));
  if (!engine)
    throw InvalidArgument("clouds in device memory need a CUDA context, this one is " +
                          context.description());
  const std::shared_ptr<AdoptedCloud> adopted = engine->adopt(raw, stream);
  const std::array<double, 3> origin{cloud.origin[0], cloud.origin[1], cloud.origin[2]};
  return std::async(std::launch::async, [engine, adopted, options, origin] {
    const std::shared_ptr<PreparedState> state = engine->prepare_adopted(*adopted, options);
    std::copy(origin.begin(), origin.end(), state->frame_offset);
    return Access::cloud(state);
  });
}

}  // namespace gpureg
