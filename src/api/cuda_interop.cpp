// SPDX-License-Identifier: BSD-3-Clause
#include "gpureg/cuda_interop.hpp"

#include <algorithm>
#include <array>

#include "api/access.hpp"
#include "api/name_cloud.hpp"
#include "api/raw_cloud.hpp"
#include "common/in_halves.hpp"
#include "pipeline/device_engine.hpp"

namespace gpureg {
namespace {

/// Clouds whose rows are on their way into the memory of the engine.
struct AdoptedBatch {
  std::shared_ptr<DeviceEngine> engine;
  std::vector<std::shared_ptr<AdoptedCloud>> clouds;
  std::vector<std::array<double, 3>> origins;
  PrepareOptions options;
  std::vector<std::string> names;
};

AdoptedBatch adopt(const Context& context, const std::vector<DevicePointCloudView>& clouds,
                   const PrepareOptions& options, const std::vector<CudaStream>& streams,
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
    out.origins.push_back({cloud.origin[0], cloud.origin[1], cloud.origin[2]});
  }
  return out;
}

std::vector<PreparedCloud> prepared(const AdoptedBatch& batch) {
  std::vector<PreparedCloud> out;
  in_halves(0, batch.clouds.size(), [&](std::size_t begin, std::size_t end) {
    const auto work = [&] {
      return batch.engine->prepare_adopted({batch.clouds.data() + begin, end - begin},
                                           batch.options);
    };
    const std::size_t all = batch.clouds.size();
    for (auto& state : end - begin == 1 ? naming_cloud(batch.names, all, begin, work) : work()) {
      const std::array<double, 3>& origin = batch.origins[out.size()];
      std::copy(origin.begin(), origin.end(), state->frame_offset);
      out.push_back(Access::cloud(std::move(state)));
    }
  });
  return out;
}

}  // namespace

std::future<PreparedCloud> prepare_async(const Context& context, const DevicePointCloudView& cloud,
                                         const PrepareOptions& options, CudaStream stream) {
  return std::async(std::launch::async, [batch = adopt(context, {cloud}, options, {stream}, {})] {
    return prepared(batch).front();
  });
}

std::future<std::vector<PreparedCloud>> prepare_batch_async(
    const Context& context, const std::vector<DevicePointCloudView>& clouds,
    const PrepareOptions& options, const std::vector<CudaStream>& streams,
    const std::vector<std::string>& names) {
  return std::async(std::launch::async, [batch = adopt(context, clouds, options, streams, names)] {
    return prepared(batch);
  });
}

}  // namespace gpureg
