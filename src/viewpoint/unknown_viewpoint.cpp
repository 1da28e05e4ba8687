// SPDX-License-Identifier: BSD-3-Clause
#include "viewpoint/unknown_viewpoint.hpp"

#include <algorithm>
#include <cmath>
#include <thread>
#include <utility>

#include "common/limits.hpp"
#include "common/validate.hpp"
#include "math/exponential.hpp"
#include "viewpoint/signs_like.hpp"
#include "viewpoint/turned_clouds.hpp"

namespace gpureg {
namespace {

/// Neighbours of the surface graph: about twenty lie within so many normal radii on a plane of
/// prepared points.
constexpr float kGraphRadius = 1.25f;

/// Points of the copy that decides for the others, about: larger voxels bridge gaps and clutter.
constexpr double kPointsOfDecision = 1500;

/// The origin of a cloud's frame, relative to its rows.
Vec3 origin_of_rows(const CloudKnowledge& known) {
  return {static_cast<float>(-known.origin[0]), static_cast<float>(-known.origin[1]),
          static_cast<float>(-known.origin[2])};
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
  waiting_.push_back(std::move(work));
  if (working_) return;
  working_ = true;  // also after a failure: what waits then is not begun
  early_ = std::async(std::launch::async, [this] {
    while (const std::function<void()> next = next_work()) next();
  });
}

std::function<void()> UnknownViewpoints::next_work() {
  const std::lock_guard<std::mutex> lock(mutex_);
  working_ = !waiting_.empty();
  if (!working_) return nullptr;
  std::function<void()> out = std::move(waiting_.front());
  waiting_.pop_front();
  return out;
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
    out.sides.signs =
        signs_like({first.surface, states[chosen]->origin}, first.sides.signs,
                   {out.surface, states[k]->origin}, factor,
                   options_.normal_radius * static_cast<float>(std::max(factor, 1.0)));
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
  std::vector<TurnedCloud> turned;
  for (std::size_t k = 0; k < states.size(); ++k)
    if (!decisions_[k].sides.signs.empty())
      turned.push_back(turn(states[k], decisions_[k].surface, decisions_[k].sides,
                            knowledge_[k].features, raw_[k].matched_only));
  prepare_again(engine_, options_, turned);
}

}  // namespace gpureg
