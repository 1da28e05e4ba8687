// SPDX-License-Identifier: BSD-3-Clause
#include "loop_closure/neighbors.hpp"

#include <algorithm>
#include <map>
#include <tuple>

#include "loop_closure/paths.hpp"
#include "math/exponential.hpp"
#include "reconstruction/audit/in_units.hpp"
#include "reconstruction/audit/pair_verdicts.hpp"

namespace gpureg::loop_closure {
namespace {

/// Steps of odometry to a neighbour, and pairs of neighbours that are asked: each costs a tenth of
/// a registration.
constexpr int kHops = 2;
constexpr std::size_t kMostPairs = 4;

struct Neighbor {
  FragmentId id = 0;
  int hops = 0;
  double sigma = 0;  ///< of its pose, metres
  pose_graph::Pose root_from_here;
};

/// Fragments with clouds whose relative pose odometry knows well enough, the root among them.
std::vector<Neighbor> neighbors_of(FragmentId root, const State& state, const Paths& odometry,
                                   double max_sigma) {
  PathTree tree = odometry.tree(odometry.position(root), kHops);
  std::vector<Neighbor> out;
  for (int k = 0; k < odometry.size(); ++k) {
    if (!tree.reaches(k)) continue;
    const Node& node = state.nodes.at(odometry.id(k));
    if (!node.has_cloud || !node.cloud.valid()) continue;
    const UncertainPose pose = tree.root_from(k);
    const double sigma =
        odometry.id(k) == root ? 0 : sigma_at(pose.covariance, node.coarse().centre);
    if (sigma <= max_sigma) out.push_back({odometry.id(k), tree.hops(k), sigma, pose.pose});
  }
  return out;
}

/// Pairs of neighbours of both ends, the closest ones.
std::vector<std::pair<Neighbor, Neighbor>> pairs_beside(const LoopRecord& record,
                                                        const State& state, const Paths& odometry,
                                                        double max_sigma) {
  std::vector<std::pair<Neighbor, Neighbor>> out;
  const std::vector<Neighbor> targets = neighbors_of(record.target, state, odometry, max_sigma);
  for (const Neighbor& a : neighbors_of(record.source, state, odometry, max_sigma))
    for (const Neighbor& b : targets)
      if (a.id != b.id && a.hops + b.hops > 0 && a.sigma + b.sigma <= max_sigma &&
          pair_of(a.id, b.id) != pair_of(record.source, record.target))
        out.emplace_back(a, b);
  std::sort(out.begin(), out.end(), [](const auto& x, const auto& y) {
    return std::tuple(x.first.hops + x.second.hops, x.first.id, x.second.id) <
           std::tuple(y.first.hops + y.second.hops, y.first.id, y.second.id);
  });
  if (out.size() > kMostPairs) out.resize(kMostPairs);
  return out;
}

}  // namespace

void hear_neighbors(const Context& context, const State& state, const Options& options,
                    std::vector<LoopRecord>& records) {
  if (options.accept_by_graph_alone) return;
  const reconstruction::AuditOptions audit =
      reconstruction::in_units({}, options.registration.voxel_size);
  const Paths odometry(state, false, options);
  std::vector<PreparedCloud> clouds;
  std::map<FragmentId, std::uint32_t> places;
  const auto place = [&](FragmentId id) {
    const auto [at, fresh] = places.try_emplace(id, static_cast<std::uint32_t>(clouds.size()));
    if (fresh) clouds.push_back(state.nodes.at(id).cloud);
    return at->second;
  };
  std::vector<reconstruction::AuditedPair> asked;
  std::vector<std::size_t> asked_for;  // records
  for (std::size_t k = 0; k < records.size(); ++k) {
    if (records[k].modes.empty()) continue;
    const pose_graph::Pose loop = to_pose(records[k].modes.front().target_from_source);
    for (const auto& [a, b] : pairs_beside(records[k], state, odometry, audit.max_shift)) {
      reconstruction::AuditedPair pair;
      pair.source = place(a.id);
      pair.target = place(b.id);
      pair.target_from_source =
          rigid(to_isometry(b.root_from_here.inverse() * (loop * a.root_from_here)));
      asked.push_back(pair);
      asked_for.push_back(k);
    }
  }
  reconstruction::judge_pairs(context, clouds, options.registration, audit, asked);
  std::map<std::size_t, double> against;
  for (std::size_t k = 0; k < asked.size(); ++k)
    if (asked[k].log_likelihood_ratio < 0) against[asked_for[k]] += asked[k].log_likelihood_ratio;
  for (const auto& [record, log_likelihood_ratio] : against) {
    std::vector<Mode>& modes = records[record].modes;
    const double odds =
        modes[0].confidence / (1 - modes[0].confidence) * portable::exp(log_likelihood_ratio);
    modes[0].confidence = odds / (1 + odds);
    std::stable_sort(modes.begin(), modes.end(),
                     [](const Mode& x, const Mode& y) { return x.confidence > y.confidence; });
    choose_mode(records[record], 0);
  }
}

}  // namespace gpureg::loop_closure
