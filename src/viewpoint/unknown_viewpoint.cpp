// SPDX-License-Identifier: BSD-3-Clause
#include "viewpoint/unknown_viewpoint.hpp"

#include <algorithm>
#include <cmath>
#include <thread>
#include <utility>

#include "common/host_threads.hpp"
#include "common/in_halves.hpp"
#include "common/limits.hpp"
#include "common/validate.hpp"
#include "pipeline/runs.hpp"
#include "viewpoint/viewpoint_inference.hpp"

namespace gpureg {
namespace {

/// Neighbours of the surface graph: about twenty lie within so many normal radii on a plane of
/// prepared points.
constexpr float kGraphRadius = 1.25f;

/// Points from which another thread is worth its start.
constexpr std::size_t kPointsPerThread = 2'000;

/// Points that are prepared together: a preparation takes twice the memory of its result.
constexpr std::size_t kPointsTogether = std::size_t(1) << 20;

/// A cloud whose sides are to be decided.
struct OpenCloud {
  std::size_t index;
  std::vector<Vec3> points, normals;
  InferredSides sides;
};

InferredSides sides_of(const SurfaceGraph& graph, const RawCloud& raw, const CloudKnowledge& known,
                       const PreparedState& state) {
  if (known.normals) return check_given_sides(graph);
  const double* offset = state.frame_offset;
  const Vec3 of_rows{static_cast<float>(-offset[0]), static_cast<float>(-offset[1]),
                     static_cast<float>(-offset[2])};
  const Vec3 local = of_rows - Vec3{state.origin[0], state.origin[1], state.origin[2]};
  return infer_sides(graph, local, raw, of_rows, known.infer_viewpoint);
}

/// Points of a prepared cloud with other sides, as input of a preparation that keeps them.
struct Replacement {
  std::vector<Vec3> points, normals;
  std::vector<float> features;
  std::uint32_t feature_dimension = 0;

  Replacement(const OpenCloud& cloud, const PreparedState& state, bool own_features, float sign)
      : points(cloud.points), normals(cloud.normals) {
    for (std::size_t i = 0; i < normals.size(); ++i)
      normals[i] = normals[i] * (sign * static_cast<float>(cloud.sides.signs[i]));
    if (!own_features) return;
    features = state.copy_features();
    feature_dimension = state.feature_dimension;
  }

  RawCloud raw() const {
    RawCloud out{};
    out.points = &points.data()->x;
    out.size = points.size();
    out.point_stride = out.normal_stride = 3;
    out.normals = &normals.data()->x;
    if (features.empty()) return out;
    out.features = features.data();
    out.feature_dimension = out.feature_stride = feature_dimension;
    return out;
  }
};

/// What a cloud that is prepared from prepared points takes over from them.
struct Inheritance {
  PrepareOptions options;
  PrepareStatistics statistics;
  float origin[3];
  double frame_offset[3];
  std::vector<Vec3> viewpoints;

  explicit Inheritance(const PreparedState& from)
      : options(from.options), statistics(from.statistics), viewpoints(from.viewpoints) {
    std::copy(from.origin, from.origin + 3, origin);
    std::copy(from.frame_offset, from.frame_offset + 3, frame_offset);
  }

  void give(PreparedState& to) const {
    to.options = options;
    const Vec3 moved{to.origin[0], to.origin[1], to.origin[2]};
    to.viewpoints.clear();
    for (const Vec3& viewpoint : viewpoints) to.viewpoints.push_back(viewpoint - moved);
    for (int k = 0; k < 3; ++k) {
      to.origin[k] += origin[k];
      to.frame_offset[k] = frame_offset[k];
    }
    PrepareStatistics& s = to.statistics;
    s.input_points = statistics.input_points;
    s.invalid_points = statistics.invalid_points;
    s.stray_points = statistics.stray_points;
    s.viewpoint = statistics.viewpoint;
    s.repaired_normals = statistics.repaired_normals;
    s.downsample += statistics.downsample;
    s.normals += statistics.normals;
    s.features += statistics.features;
    s.grid += statistics.grid;
    s.depth_maps += statistics.depth_maps;
    s.surface_sides += statistics.surface_sides;
  }
};

void decide(Engine& engine, Span<const RawCloud> raw, const std::vector<CloudKnowledge>& knowledge,
            const PrepareOptions& options,
            const std::vector<std::shared_ptr<PreparedState>>& states,
            std::vector<OpenCloud>& open) {
  // It computes much and reads little, so with a device it is worth all processors.
  const std::size_t threads =
      std::max({1u, engine.host_threads(),
                engine.leaves_host_idle() ? std::thread::hardware_concurrency() : 1u});
  const std::size_t workers = std::max<std::size_t>(1, std::min(threads, open.size()));
  on_threads(workers, [&](std::size_t worker) {
    for (std::size_t k = worker; k < open.size(); k += workers) {
      OpenCloud& cloud = open[k];
      PreparedState& state = *states[cloud.index];
      const SurfaceGraph graph(
          cloud.points, cloud.normals, kGraphRadius * options.normal_radius,
          std::min(threads / workers, 1 + cloud.points.size() / kPointsPerThread));
      cloud.sides = sides_of(graph, raw.data[cloud.index], knowledge[cloud.index], state);
      state.statistics.viewpoint = cloud.sides.source;
      if (knowledge[cloud.index].normals)
        state.statistics.repaired_normals = static_cast<std::uint32_t>(
            std::count(cloud.sides.signs.begin(), cloud.sides.signs.end(), std::int8_t(-1)));
    }
  });
}

}  // namespace

void check_viewpoints(const CloudKnowledge& knowledge, const PreparedState& state) {
  if (!knowledge.viewpoints) return;
  const float most = limits::kMaxViewpointDistance * state.options.normal_radius;
  for (const Vec3& place : state.viewpoints)
    for (const float coordinate : {place.x, place.y, place.z})
      require(std::abs(coordinate) <= most, "cloud.viewpoints", coordinate,
              "coordinates within 2^23 times prepare.normal_radius of the cloud: float cannot tell "
              "the rays of a farther viewpoint apart");
}

void resolve_viewpoints(Engine& engine, Span<const RawCloud> raw,
                        const std::vector<CloudKnowledge>& knowledge, const PrepareOptions& options,
                        std::vector<std::shared_ptr<PreparedState>>& states) {
  std::vector<OpenCloud> open;
  for (std::size_t k = 0; k < states.size(); ++k) {
    PreparedState& state = *states[k];
    const CloudKnowledge& known = knowledge[k];
    state.statistics.viewpoint = known.viewpoints ? ViewpointSource::said
                                 : known.model    ? ViewpointSource::model
                                 : known.normals  ? ViewpointSource::normals
                                                  : ViewpointSource::origin;
    if (known.viewpoints || known.model || options.depth_maps == 0 || state.size == 0) continue;
    open.push_back({k, state.copy_points(), state.copy_normals(), {}});
  }
  decide(engine, raw, knowledge, options, states, open);

  std::vector<Replacement> replacements;
  std::vector<Inheritance> inheritances;
  std::vector<RawCloud> inputs;
  std::vector<std::size_t> first{0};  // of each cloud: its sides stay together
  for (const OpenCloud& cloud : open) {
    if (cloud.sides.signs.empty()) continue;
    const bool own_features = knowledge[cloud.index].features;
    replacements.emplace_back(cloud, *states[cloud.index], own_features, 1.0f);
    if (!cloud.sides.sign_known)
      replacements.emplace_back(cloud, *states[cloud.index], own_features, -1.0f);
    first.push_back(replacements.size());
    inheritances.emplace_back(*states[cloud.index]);
    // Of a large cloud it takes gigabytes, and so do its replacements.
    states[cloud.index].reset();
  }
  if (replacements.empty()) return;
  for (const Replacement& replacement : replacements) inputs.push_back(replacement.raw());
  PrepareOptions as_they_are = options;
  as_they_are.voxel_size = 0;
  std::vector<std::shared_ptr<PreparedState>> prepared;
  const auto runs = pipeline::runs_within(inheritances.size(), kPointsTogether, [&](std::size_t k) {
    return inputs[first[k]].size * (first[k + 1] - first[k]);
  });
  for (const pipeline::Run& run : runs)
    in_halves(first[run.begin], first[run.end], [&](std::size_t begin, std::size_t end) {
      for (auto& state : engine.prepare({inputs.data() + begin, end - begin}, as_they_are))
        prepared.push_back(std::move(state));
    });
  auto next = prepared.begin();
  auto inheritance = inheritances.begin();
  for (const OpenCloud& cloud : open) {
    if (cloud.sides.signs.empty()) continue;
    std::shared_ptr<PreparedState>& state = states[cloud.index];
    state = *next++;
    inheritance->give(*state);
    if (!cloud.sides.sign_known) {
      state->other_sides = *next++;
      inheritance->give(*state->other_sides);
    }
    ++inheritance;
  }
}

}  // namespace gpureg
