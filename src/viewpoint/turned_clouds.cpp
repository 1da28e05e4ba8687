// SPDX-License-Identifier: BSD-3-Clause
#include "viewpoint/turned_clouds.hpp"

#include <algorithm>
#include <iterator>
#include <utility>

#include "common/in_halves.hpp"
#include "pipeline/runs.hpp"

namespace gpureg {
namespace {

/// Points that are prepared together: a preparation takes twice the memory of its result.
constexpr std::size_t kPointsTogether = std::size_t(1) << 20;

/// What a cloud that is prepared from prepared points takes over from them.
void inherit(const PreparedFacts& before, PreparedState& state) {
  state.options = before.options;
  state.plane = before.plane;
  const Vec3 moved{state.origin[0], state.origin[1], state.origin[2]};
  state.viewpoints.clear();
  for (const Vec3& viewpoint : before.viewpoints) state.viewpoints.push_back(viewpoint - moved);
  for (int k = 0; k < 3; ++k) {
    state.origin[k] += before.origin[k];
    state.frame_offset[k] = before.frame_offset[k];
  }
  const PrepareStatistics now = std::exchange(state.statistics, before.statistics);
  PrepareStatistics& s = state.statistics;
  s.points = now.points;
  s.points_without_normal = now.points_without_normal;
  s.points_without_feature = now.points_without_feature;
  s.downsample += now.downsample;
  s.normals += now.normals;
  s.features += now.features;
  s.grid += now.grid;
  s.depth_maps += now.depth_maps;
  s.surface_sides += now.surface_sides;
}

}  // namespace

RawCloud TurnedCloud::raw(std::size_t side) const {
  RawCloud out{};
  out.points = &surface.points.data()->x;
  out.size = surface.points.size();
  out.point_stride = out.normal_stride = 3;
  out.normals = &normals[side].data()->x;
  out.matched_only = matched_only;
  if (features.empty()) return out;
  out.features = features.data();
  out.feature_dimension = out.feature_stride = before.feature_dimension;
  return out;
}

TurnedCloud turn(std::shared_ptr<PreparedState>& state, const PointsAndNormals& surface,
                 const InferredSides& sides, bool own_features, bool matched_only) {
  TurnedCloud out{state, *state, surface, {}, {}, matched_only};
  for (const float sign : {1.0f, -1.0f}) {
    if (sign < 0 && sides.sign_known) break;
    std::vector<Vec3>& normals = out.normals.emplace_back(surface.normals);
    for (std::size_t i = 0; i < normals.size(); ++i)
      normals[i] = normals[i] * (sign * static_cast<float>(sides.signs[i]));
  }
  if (own_features) out.features = state->copy_features();
  state.reset();
  return out;
}

void prepare_again(Engine& engine, const PrepareSettings& options,
                   std::vector<TurnedCloud>& turned) {
  PrepareSettings as_they_are = options;
  as_they_are.voxel_size = 0;
  const auto runs = pipeline::runs_within(turned.size(), kPointsTogether, [&](std::size_t k) {
    return turned[k].surface.points.size() * turned[k].normals.size();
  });
  for (const pipeline::Run& run : runs) {
    std::vector<RawCloud> inputs;
    for (std::size_t k = run.begin; k < run.end; ++k)
      for (std::size_t side = 0; side < turned[k].normals.size(); ++side)
        inputs.push_back(turned[k].raw(side));
    std::vector<std::shared_ptr<PreparedState>> made;
    in_halves(0, inputs.size(), [&](std::size_t begin, std::size_t end) {
      auto part = engine.prepare({inputs.data() + begin, end - begin}, as_they_are);
      std::move(part.begin(), part.end(), std::back_inserter(made));
    });
    auto next = made.begin();
    for (std::size_t k = run.begin; k < run.end; ++k) {
      TurnedCloud& cloud = turned[k];
      cloud.state = *next++;
      inherit(cloud.before, *cloud.state);
      if (cloud.normals.size() == 1) continue;
      cloud.state->other_sides = *next++;
      inherit(cloud.before, *cloud.state->other_sides);
    }
  }
}

}  // namespace gpureg
