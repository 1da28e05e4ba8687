// SPDX-License-Identifier: BSD-3-Clause
#include "gpureg/cuda_interop.hpp"

#include <algorithm>
#include <array>

#include "api/access.hpp"
#include "api/name_cloud.hpp"
#include "api/raw_cloud.hpp"
#include "pipeline/device_engine.hpp"
#include "settings/resolve.hpp"
#include "viewpoint/unknown_viewpoint.hpp"

namespace gpureg {
namespace {

/// Clouds whose rows are on their way into the memory of the engine.
struct AdoptedBatch {
  std::shared_ptr<DeviceEngine> engine;
  std::vector<std::shared_ptr<AdoptedCloud>> clouds;
  std::vector<std::array<double, 3>> origins;
  std::vector<CloudKnowledge> knowledge;
  PrepareSettings options;
  std::vector<std::string> names;
};

AdoptedBatch adopt(const Context& context, const std::vector<DevicePointCloudView>& clouds,
                   const PrepareSettings& options, const std::vector<CudaStream>& streams,
                   const std::vector<std::string>& names) {
  options.validate();
  check_names(names, clouds.size());
  if (streams.size() != 1 && streams.size() != clouds.size())
    throw InvalidArgument("streams has " + std::to_string(streams.size()) +
                          " entries, expected 1 or one for each of " +
                          std::to_string(clouds.size()) + " clouds");
  AdoptedBatch out;
  out.engine = std::dynamic_pointer_cast<DeviceEngine>(Access::engine(context));
  out.options = options;
  out.names = names;
  for (std::size_t k = 0; k < clouds.size(); ++k) {
    const DevicePointCloudView& cloud = clouds[k];
    naming_cloud(names, clouds.size(), k, [&] {
      RawCloud raw = raw_cloud(cloud);
      FrameOrigin frame_origin;
      view_from_frame_origin(cloud.origin, frame_origin, raw);
      if (!out.engine)
        throw InvalidArgument("clouds in device memory need a CUDA context, this one is " +
                              context.description());
      const CudaStream stream = streams[streams.size() == 1 ? 0 : k];
      out.clouds.push_back(out.engine->adopt(raw, {stream, cloud.normal_stream.value_or(stream),
                                                   cloud.feature_stream.value_or(stream)}));
    });
    out.knowledge.push_back(knowledge_of(cloud));
    out.origins.push_back({cloud.origin[0], cloud.origin[1], cloud.origin[2]});
  }
  return out;
}

/// The clouds' sides are decided from host copies of the points where they are asked for.
std::vector<PreparedCloud> prepared(const AdoptedBatch& batch) {
  const std::size_t all = batch.clouds.size();
  auto states = prepare_named(batch.names, all, [&](std::size_t begin, std::size_t end) {
    return batch.engine->prepare_adopted({batch.clouds.data() + begin, end - begin}, batch.options);
  });
  std::vector<std::vector<float>> rows(all);
  std::vector<RawCloud> raw(all);
  for (std::size_t k = 0; k < all; ++k) {
    const CloudKnowledge& known = batch.knowledge[k];
    std::copy(batch.origins[k].begin(), batch.origins[k].end(), states[k]->frame_offset);
    naming_cloud(batch.names, all, k, [&] { check_viewpoints(known, *states[k]); });
    if (!known.viewpoints && !known.normals && batch.options.depth_maps > 0)
      rows[k] = batch.engine->copy_points(*batch.clouds[k]);
    raw[k].points = rows[k].data();
    raw[k].size = rows[k].size() / 3;
    raw[k].point_stride = 3;
  }
  UnknownViewpoints(*batch.engine, span_of(raw), batch.knowledge, batch.options).resolve(states);
  return Access::clouds(std::move(states));
}

}  // namespace

std::future<PreparedCloud> prepare_async(const Context& context, const DevicePointCloudView& cloud,
                                         const RegistrationOptions& options, CudaStream stream) {
  return std::async(std::launch::async,
                    [batch = adopt(context, {cloud}, resolve(options).prepare, {stream}, {})] {
                      return prepared(batch).front();
                    });
}

std::future<std::vector<PreparedCloud>> prepare_batch_async(
    const Context& context, const std::vector<DevicePointCloudView>& clouds,
    const RegistrationOptions& options, const std::vector<CudaStream>& streams,
    const std::vector<std::string>& names) {
  return std::async(std::launch::async,
                    [batch = adopt(context, clouds, resolve(options).prepare, streams, names)] {
                      return prepared(batch);
                    });
}

}  // namespace gpureg
