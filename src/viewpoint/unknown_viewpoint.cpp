// SPDX-License-Identifier: BSD-3-Clause
#include "viewpoint/unknown_viewpoint.hpp"

#include <algorithm>
#include <cmath>
#include <thread>
#include <utility>

#include "algorithm/cell.hpp"
#include "common/in_halves.hpp"
#include "common/limits.hpp"
#include "common/validate.hpp"
#include "math/exponential.hpp"
#include "pipeline/runs.hpp"

namespace gpureg {
namespace {

/// Neighbours of the surface graph: about twenty lie within so many normal radii on a plane of
/// prepared points.
constexpr float kGraphRadius = 1.25f;

/// Points of the copy that decides for the others, about: larger voxels bridge gaps and clutter.
constexpr double kPointsOfDecision = 1500;

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

  bool matched_only;

  Replacement(const PointsAndNormals& surface, const SurfaceGraph::Signs& signs,
              const PreparedState& state, bool own_features, float sign, bool matches)
      : points(surface.points), normals(surface.normals), matched_only(matches) {
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
    out.matched_only = matched_only;
    if (features.empty()) return out;
    out.features = features.data();
    out.feature_dimension = out.feature_stride = feature_dimension;
    return out;
  }
};

/// What a cloud that is prepared from prepared points takes over from them.
struct Inheritance {
  PrepareSettings options;
  PrepareStatistics statistics;
  float origin[3];
  double frame_offset[3];
  ScanPlane plane;
  std::vector<Vec3> viewpoints;

  explicit Inheritance(const PreparedState& from)
      : options(from.options),
        statistics(from.statistics),
        plane(from.plane),
        viewpoints(from.viewpoints) {
    std::copy(from.origin, from.origin + 3, origin);
    std::copy(from.frame_offset, from.frame_offset + 3, frame_offset);
  }

  void give(PreparedState& to) const {
    to.options = options;
    to.plane = plane;
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
    s.range_limit_points = statistics.range_limit_points;
    s.smallest_range = statistics.smallest_range;
    s.largest_range = statistics.largest_range;
    s.viewpoint = statistics.viewpoint;
    s.repaired_normals = statistics.repaired_normals;
    s.flat = statistics.flat;
    s.downsample += statistics.downsample;
    s.normals += statistics.normals;
    s.features += statistics.features;
    s.grid += statistics.grid;
    s.depth_maps += statistics.depth_maps;
    s.surface_sides += statistics.surface_sides;
  }
};

/// A surface with known sides, for the sides of a copy of it.
class OrientedSurface {
 public:
  /// @param reach of a point's side, in the unit of the copy.
  OrientedSurface(const PointsAndNormals& surface, const SurfaceGraph::Signs& signs,
                  const float (&origin)[3], double factor, float reach)
      : reach_(reach), inverse_(1 / reach) {
    const auto scaled = [&](float x, float of_origin) {
      return static_cast<float>((static_cast<double>(x) + static_cast<double>(of_origin)) * factor);
    };
    for (std::size_t i = 0; i < surface.points.size(); ++i) {
      const Vec3 p = surface.points[i];
      points_.push_back({scaled(p.x, origin[0]), scaled(p.y, origin[1]), scaled(p.z, origin[2])});
      normals_.push_back(surface.normals[i] * static_cast<float>(signs[i]));
      const Cell cell = cell_of(points_.back(), inverse_);
      if (in_key_range(cell)) order_.emplace_back(cell_key(cell), static_cast<std::uint32_t>(i));
    }
    std::sort(order_.begin(), order_.end());
  }

  /// The side that the points around show, 1 without any.
  std::int8_t sign_of(Vec3 point, Vec3 normal) const {
    const Cell at = cell_of(point, inverse_);
    float sum = 0;
    for (std::int32_t z = at.z - 1; z <= at.z + 1; ++z)
      for (std::int32_t y = at.y - 1; y <= at.y + 1; ++y) {
        const Cell first{at.x - 1, y, z}, last{at.x + 1, y, z};
        if (!in_key_range(first) || !in_key_range(last)) continue;
        for (auto k = std::lower_bound(order_.begin(), order_.end(),
                                       std::pair(cell_key(first), std::uint32_t{0}));
             k != order_.end() && k->first <= cell_key(last); ++k) {
          const float closeness =
              1 - squared_norm(points_[k->second] - point) * inverse_ * inverse_;
          if (closeness > 0) sum += closeness * dot(normals_[k->second], normal);
        }
      }
    return sum < 0 ? -1 : 1;
  }

 private:
  std::vector<Vec3> points_, normals_;
  std::vector<std::pair<std::uint64_t, std::uint32_t>> order_;  ///< by cell
  float reach_, inverse_;
};

SurfaceGraph::Signs signs_like(const OrientedSurface& other, const PointsAndNormals& surface,
                               const float (&origin)[3]) {
  SurfaceGraph::Signs out;
  for (std::size_t i = 0; i < surface.points.size(); ++i)
    out.push_back(other.sign_of(surface.points[i] + Vec3{origin[0], origin[1], origin[2]},
                                surface.normals[i]));
  return out;
}

}  // namespace

void check_viewpoints(const CloudKnowledge& knowledge, const PreparedState& state) {
  if (!knowledge.viewpoints) return;
  const float most = limits::kMaxViewpointDistance * state.options.normal_radius;
  for (const Vec3& place : state.viewpoints)
    for (const float coordinate : {place.x, place.y, place.z})
      require(std::abs(coordinate) <= most, "cloud.viewpoints", coordinate,
              "coordinates within 2^23 times prepare.normal_radius of the cloud: float cannot tell "
              "the rays of a farther viewpoint apart; is it in the frame of the cloud?");
}

UnknownViewpoints::UnknownViewpoints(Engine& engine, Span<const RawCloud> raw,
                                     const std::vector<CloudKnowledge>& knowledge,
                                     const PrepareSettings& options, std::vector<double> scales)
    : engine_(engine),
      raw_(raw),
      knowledge_(knowledge),
      options_(options),
      scales_(std::move(scales)),
      spread_(raw.size),
      decisions_(raw.size) {}

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

void UnknownViewpoints::meanwhile(std::function<void()> work) {
  const std::lock_guard<std::mutex> lock(mutex_);
  early_ = std::async([before = std::move(early_), work = std::move(work)]() mutable {
    if (before.valid()) before.get();
    work();
  });
}

std::vector<std::shared_ptr<PreparedState>> UnknownViewpoints::prepare(std::size_t begin,
                                                                       std::size_t end) {
  std::vector<std::size_t> asked;
  bool any_open = false;
  for (std::size_t k = 0; k < raw_.size; ++k) {
    any_open = any_open || is_open(k);
    if (asks_rows(k)) asked.push_back(k);
  }
  SurfaceWatcher watcher;
  if (any_open && scales_.empty() && engine_.leaves_host_idle()) {
    if (!early_.valid())
      meanwhile([this, asked = std::move(asked)] {
        threads().parallel(asked.size(), [&](std::size_t k) { measure_rows(asked[k]); });
      });
    watcher = [this, begin](std::size_t first, std::vector<EarlySurface> chunk) {
      meanwhile([this, first = begin + first, chunk = std::move(chunk)]() mutable {
        threads().parallel(chunk.size(), [&](std::size_t k) {
          decide(first + k, std::move(chunk[k]), chunk[k].origin);
        });
      });
    };
  }
  return engine_.prepare({raw_.data + begin, end - begin}, options_, watcher);
}

void UnknownViewpoints::decide(std::size_t cloud, PointsAndNormals surface,
                               const float (&origin)[3]) {
  Decision& out = decisions_[cloud];
  if (out.made || !is_open(cloud) || surface.points.empty()) return;
  const CloudKnowledge& known = knowledge_[cloud];
  const bool asks = asks_rows(cloud);
  if (asks) measure_rows(cloud);
  if (asks && is_scanner(*spread_[cloud])) {
    out.sides.source = ViewpointSource::origin;
  } else {
    out.surface = std::move(surface);
    const SurfaceGraph graph(out.surface.points, out.surface.normals,
                             kGraphRadius * options_.normal_radius, threads());
    const Vec3 of_rows = origin_of_rows(known);
    const Vec3 local = of_rows - Vec3{origin[0], origin[1], origin[2]};
    out.sides = known.normals ? check_given_sides(graph, !known.flat)
                              : infer_sides(graph, local, raw_[cloud], of_rows,
                                            asks ? &*spread_[cloud] : nullptr, !known.flat);
  }
  out.made = true;
}

void UnknownViewpoints::decide_copies(const std::vector<std::shared_ptr<PreparedState>>& states,
                                      const std::vector<std::size_t>& copies) {
  const auto distance = [&](std::size_t k) {
    return std::abs(portable::log(static_cast<double>(states[k]->size) / kPointsOfDecision));
  };
  const std::size_t chosen =
      *std::min_element(copies.begin(), copies.end(),
                        [&](std::size_t a, std::size_t b) { return distance(a) < distance(b); });
  decide(chosen, states[chosen]->copy_points_and_normals(), states[chosen]->origin);
  const Decision& first = decisions_[chosen];
  const bool sides = !first.sides.signs.empty();
  threads().parallel(copies.size(), [&](std::size_t c) {
    const std::size_t k = copies[c];
    Decision& out = decisions_[k];
    if (out.made) return;
    out.made = true;
    out.sides.source = first.sides.source;
    out.sides.sign_known = first.sides.sign_known;
    if (!sides) return;
    out.surface = states[k]->copy_points_and_normals();
    const double factor = scales_[k] / scales_[chosen];
    out.sides.signs = signs_like(
        OrientedSurface(first.surface, first.sides.signs, states[chosen]->origin, factor,
                        options_.normal_radius * static_cast<float>(std::max(factor, 1.0))),
        out.surface, states[k]->origin);
  });
}

void UnknownViewpoints::set_statistics(std::size_t cloud, PrepareStatistics& statistics) const {
  const CloudKnowledge& known = knowledge_[cloud];
  const Decision& decision = decisions_[cloud];
  statistics.viewpoint = decision.made      ? decision.sides.source
                         : known.viewpoints ? ViewpointSource::given
                         : known.model      ? ViewpointSource::model
                         : known.normals    ? ViewpointSource::normals
                                            : ViewpointSource::origin;
  if (decision.made && known.normals)
    statistics.repaired_normals = static_cast<std::uint32_t>(
        std::count(decision.sides.signs.begin(), decision.sides.signs.end(), std::int8_t(-1)));
}

void UnknownViewpoints::resolve(std::vector<std::shared_ptr<PreparedState>>& states) {
  if (early_.valid()) early_.get();
  std::vector<std::size_t> undecided;
  for (std::size_t k = 0; k < states.size(); ++k)
    if (is_open(k) && !decisions_[k].made && states[k]->size > 0) undecided.push_back(k);
  if (!undecided.empty() && !scales_.empty())
    decide_copies(states, undecided);
  else if (!undecided.empty())
    threads().parallel(undecided.size(), [&](std::size_t k) {
      const PreparedState& state = *states[undecided[k]];
      decide(undecided[k], state.copy_points_and_normals(), state.origin);
    });
  for (std::size_t k = 0; k < states.size(); ++k) set_statistics(k, states[k]->statistics);
  prepare_again(states);
}

void UnknownViewpoints::prepare_again(std::vector<std::shared_ptr<PreparedState>>& states) {
  std::vector<Replacement> replacements;
  std::vector<Inheritance> inheritances;
  std::vector<RawCloud> inputs;
  std::vector<std::size_t> first{0};  // of each cloud: its sides stay together
  for (std::size_t k = 0; k < states.size(); ++k) {
    const InferredSides& sides = decisions_[k].sides;
    if (sides.signs.empty()) continue;
    const auto add = [&](float sign) {
      replacements.emplace_back(decisions_[k].surface, sides.signs, *states[k],
                                knowledge_[k].features, sign, raw_[k].matched_only);
    };
    add(1.0f);
    if (!sides.sign_known) add(-1.0f);
    first.push_back(replacements.size());
    inheritances.emplace_back(*states[k]);
    // Of a large cloud it takes gigabytes, and so do its replacements.
    states[k].reset();
  }
  if (replacements.empty()) return;
  for (const Replacement& replacement : replacements) inputs.push_back(replacement.raw());
  PrepareSettings as_they_are = options_;
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
  for (std::size_t k = 0; k < states.size(); ++k) {
    if (decisions_[k].sides.signs.empty()) continue;
    std::shared_ptr<PreparedState>& state = states[k];
    state = *next++;
    inheritance->give(*state);
    if (!decisions_[k].sides.sign_known) {
      state->other_sides = *next++;
      inheritance->give(*state->other_sides);
    }
    ++inheritance;
  }
}

}  // namespace gpureg
