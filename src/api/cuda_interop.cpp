// SPDX-License-Identifier: BSD-3-Clause
#include "gpureg/cuda_interop.hpp"

#include <algorithm>
#include <array>

#include "api/access.hpp"
#include "api/raw_cloud.hpp"
#include "api/unknown_viewpoint.hpp"
#include "pipeline/device_engine.hpp"

namespace gpureg {

std::future<PreparedCloud> prepare_async(const Context& context, const DevicePointCloudView& cloud,
                                         const PrepareOptions& options, CudaStream stream) {
  options.validate();
  RawCloud raw = raw_cloud(cloud);
  const CloudKnowledge known = knowledge_of(cloud);
  FrameOrigin frame_origin;
  view_from_frame_origin(cloud.origin, frame_origin, raw);
  const std::shared_ptr<DeviceEngine> engine =
      std::dynamic_pointer_cast<DeviceEngine>(Access::engine(context));
  if (!engine)
    throw InvalidArgument("clouds in device memory need a CUDA context, this one is " +
                          context.description());
  const std::shared_ptr<AdoptedCloud> adopted = engine->adopt(raw, stream);
  const std::array<double, 3> origin{cloud.origin[0], cloud.origin[1], cloud.origin[2]};
  raw.points = nullptr;  // only its form may be read from now on
  return std::async(std::launch::async, [engine, adopted, options, origin, known, raw] {
    std::vector<std::shared_ptr<PreparedState>> states{engine->prepare_adopted(*adopted, options)};
    std::copy(origin.begin(), origin.end(), states[0]->frame_offset);
    RawCloud hosted = raw;
    std::vector<float> rows;
    if (!known.viewpoints && !known.normals && options.depth_maps > 0)
      rows = engine->copy_points(*adopted);
    hosted.points = rows.data();
    hosted.size = rows.size() / 3;
    hosted.point_stride = 3;
    resolve_viewpoints(*engine, {&hosted, 1}, {known}, options, states);
    return Access::cloud(std::move(states[0]));
  });
}

}  // namespace gpureg
