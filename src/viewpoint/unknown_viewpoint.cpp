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

namespace gpureg {
namespace {

/// Neighbours of the surface graph: about twenty lie within so many normal radii on a plane of
/// prepared points.
constexpr float kGraphRadius = 1.25f;

/// Points that are prepared together: a preparation takes twice the memory of its result.
constexpr std::size_t kPointsTogether = std::size_t(1) << 20;

/// The origin of a cloud's frame, relative to its rows.
Vec3 origin_of_rows(const CloudKnowledge& known) {
  return {static_cast<float>(-known.origin[0]), static_cast<float>(-known.origin[1]),
          static_cast<float>(-known.origin[2])};
}

/// Points of a prepared cloud with other sides, as input of a preparation that keeps them.
struct Replacement {
  std::vector<Vec3> points, normals;
  std::vector<float> features;
  std::uint32_t feature_dimension = 0;

  Replacement(const std::vector<Vec3>& of_points, const std::vector<Vec3>& of_normals,
              const SurfaceGraph::Signs& signs, const PreparedState& state, bool own_features,
              float sign)
      : points(of_points), normals(of_normals) {
    for (std::size_t i = 0; i < normals.size(); ++i)
      normals[i] = normals[i] * (sign * static_cast<float>(signs[i]));
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

UnknownViewpoints::UnknownViewpoints(Engine& engine, Span<const RawCloud> raw,
                                     const std::vector<CloudKnowledge>& knowledge,
                                     const PrepareOptions& options)
    : engine_(engine), raw_(raw), knowledge_(knowledge), options_(options), spread_(raw.size) {}

bool UnknownViewpoints::is_open(std::size_t cloud) const {
  const CloudKnowledge& known = knowledge_[cloud];
  return !known.viewpoints && !known.model && options_.depth_maps > 0;
}

bool UnknownViewpoints::asks_rows(std::size_t cloud) const {
  return is_open(cloud) && !knowledge_[cloud].normals && knowledge_[cloud].infer_viewpoint;
}

ThreadGroup& UnknownViewpoints::threads() {
  // They compute much and read little, so with a device they are worth all processors.
  if (!threads_)
    threads_ = std::make_unique<ThreadGroup>(
        std::max({1u, engine_.host_threads(),
                  engine_.leaves_host_idle() ? std::thread::hardware_concurrency() : 1u}));
  return *threads_;
}

void UnknownViewpoints::measure_rows(std::size_t cloud) {
  if (!spread_[cloud])
    spread_[cloud] = spacing_spread(raw_[cloud], origin_of_rows(knowledge_[cloud]));
}

void UnknownViewpoints::during(const std::function<void()>& prepare) {
  std::vector<std::size_t> asked;
  for (std::size_t k = 0; k < raw_.size; ++k)
    if (asks_rows(k)) asked.push_back(k);
  if (asked.empty() || !engine_.leaves_host_idle()) return prepare();
  on_threads(2, [&](std::size_t thread) {
    if (thread == 0) return prepare();
    threads().parallel(asked.size(), [&](std::size_t k) { measure_rows(asked[k]); });
  });
}

void UnknownViewpoints::decide(OpenCloud& cloud, PreparedState& state) {
  const CloudKnowledge& known = knowledge_[cloud.index];
  const bool asks = asks_rows(cloud.index);
  if (asks) measure_rows(cloud.index);
  if (asks && is_scanner(*spread_[cloud.index])) {
    state.statistics.viewpoint = ViewpointSource::origin;
    return;
  }
  cloud.points = state.copy_points();
  cloud.normals = state.copy_normals();
  const SurfaceGraph graph(cloud.points, cloud.normals, kGraphRadius * options_.normal_radius,
                           threads());
  const Vec3 of_rows = origin_of_rows(known);
  const Vec3 local = of_rows - Vec3{state.origin[0], state.origin[1], state.origin[2]};
  cloud.sides = known.normals ? check_given_sides(graph)
                              : infer_sides(graph, local, raw_[cloud.index], of_rows,
                                            asks ? &*spread_[cloud.index] : nullptr);
  state.statistics.viewpoint = cloud.sides.source;
  if (known.normals)
    state.statistics.repaired_normals = static_cast<std::uint32_t>(
        std::count(cloud.sides.signs.begin(), cloud.sides.signs.end(), std::int8_t(-1)));
}

void UnknownViewpoints::resolve(std::vector<std::shared_ptr<PreparedState>>& states) {
  std::vector<OpenCloud> open;
  for (std::size_t k = 0; k < states.size(); ++k) {
    const CloudKnowledge& known = knowledge_[k];
    states[k]->statistics.viewpoint = known.viewpoints ? ViewpointSource::said
                                      : known.model    ? ViewpointSource::model
                                      : known.normals  ? ViewpointSource::normals
                                                       : ViewpointSource::origin;
    if (is_open(k) && states[k]->size > 0) open.push_back({k, {}, {}, {}});
  }
  if (open.empty()) return;
  threads().parallel(open.size(), [&](std::size_t k) { decide(open[k], *states[open[k].index]); });
  prepare_again(open, states);
}

void UnknownViewpoints::prepare_again(const std::vector<OpenCloud>& clouds,
                                      std::vector<std::shared_ptr<PreparedState>>& states) {
  std::vector<Replacement> replacements;
  std::vector<Inheritance> inheritances;
  std::vector<RawCloud> inputs;
  std::vector<std::size_t> first{0};  // of each cloud: its sides stay together
  for (const OpenCloud& cloud : clouds) {
    if (cloud.sides.signs.empty()) continue;
    const auto add = [&](float sign) {
      replacements.emplace_back(cloud.points, cloud.normals, cloud.sides.signs,
                                *states[cloud.index], knowledge_[cloud.index].features, sign);
    };
    add(1.0f);
    if (!cloud.sides.sign_known) add(-1.0f);
    first.push_back(replacements.size());
    inheritances.emplace_back(*states[cloud.index]);
    // Of a large cloud it takes gigabytes, and so do its replacements.
    states[cloud.index].reset();
  }
  if (replacements.empty()) return;
  for (const Replacement& replacement : replacements) inputs.push_back(replacement.raw());
  PrepareOptions as_they_are = options_;
  as_they_are.voxel_size = 0;
  std::vector<std::shared_ptr<PreparedState>> prepared;
  const auto runs = pipeline::runs_within(inheritances.size(), kPointsTogether, [&](std::size_t k) {
    return inputs[first[k]].size * (first[k + 1] - first[k]);
  });
  for (const pipeline::Run& run : runs)
    in_halves(first[run.begin], first[run.end], [&](std::size_t begin, std::size_t end) {
      for (auto& state : engine_.prepare({inputs.data() + begin, end - begin}, as_they_are))
        prepared.push_back(std::move(state));
    });
  auto next = prepared.begin();
  auto inheritance = inheritances.begin();
  for (const OpenCloud& cloud : clouds) {
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
