// SPDX-License-Identifier: BSD-3-Clause
#include "reconstruction/audit/joins.hpp"

#include <algorithm>
#include <cmath>
#include <map>
#include <numeric>

#include "common/stop_scope.hpp"
#include "math/exponential.hpp"
#include "reconstruction/audit/blame.hpp"
#include "reconstruction/audit/near_pairs.hpp"
#include "reconstruction/audit/pair_verdicts.hpp"
#include "reconstruction/edge_noise.hpp"
#include "reconstruction/odometry.hpp"

namespace gpureg::reconstruction {
namespace {

/// Modes from this confidence suggest a pose.
constexpr double kLeastSuggested = 0.02;
/// Poses of two islands that are tried.
constexpr std::size_t kPosesTried = 12;
/// What one pair says for a pose at most, as log odds.
constexpr double kMostOfSuggestion = 7;
/// Poses agree up to so many times the margin of the audit, and this turn (Frobenius norm).
constexpr double kSameShift = 2, kSameTurn = 0.1;
/// Log odds from which islands are joined: of the surest pair that suggests the pose, and of what
/// the pairs across say. Other poses have to be so much less likely: of 25 joins that were tried in
/// maps of offices and houses without bent parts, none of these was wrong, and below were half.
constexpr double kLeastJoined = 9, kLead = 8;
/// A pose is refined from these log odds on.
constexpr double kWorthRefining = -10;
/// Noise of the pose of two islands, metres and radians; within an island, there is nearly none.
constexpr double kShift = 0.1, kTurn = 0.03, kShiftWithin = 0.005, kTurnWithin = 0.002;

/// A pose of one pair, as that of two islands.
struct Suggestion {
  std::uint32_t source = 0, target = 0;  ///< scans
  UnalignedIsometry3d target_from_source;
  pose_graph::UnalignedMatrix6d information;
  std::uint32_t a = 0, b = 0;  ///< islands, a < b
  UnalignedIsometry3d a_from_b;
  Eigen::Vector3d centre;  ///< of the overlap, in the frame of b
  double odds = 0;         ///< logarithm
};

using Between = std::map<std::pair<std::uint32_t, std::uint32_t>, std::vector<Suggestion>>;

struct Islands {
  std::vector<std::uint32_t> of_scan;
  std::vector<UnalignedIsometry3d> island_from_scan;
};

Islands islands_of(const Reconstruction& map) {
  Islands out;
  for (const Scan& scan : map.scans) {
    out.of_scan.push_back(scan.placed ? scan.island : kNoIsland);
    out.island_from_scan.push_back(scan.island_from_scan);
  }
  return out;
}

/// @param source_centre of the overlap.
/// @param flat RegistrationResult::flat.
void suggest(const Pair& pair, const RegistrationMode& mode, const Eigen::Vector3d& source_centre,
             bool flat, const Islands& islands, const Options& options, Between& out) {
  const std::uint32_t source = islands.of_scan[pair.source], target = islands.of_scan[pair.target];
  if (source == target || source == kNoIsland || target == kNoIsland) return;
  Suggestion one;
  one.source = pair.source;
  one.target = pair.target;
  one.target_from_source = mode.target_from_source;
  one.information =
      edge_information(mode, source_centre, options.noise, options.information_unit, flat);
  one.a = std::min(source, target);
  one.b = std::max(source, target);
  const UnalignedIsometry3d& of_source = islands.island_from_scan[pair.source];
  one.a_from_b = islands.island_from_scan[pair.target] * mode.target_from_source *
                 UnalignedIsometry3d(of_source.inverse());
  one.centre = of_source * source_centre;
  if (one.a == source) {
    one.centre = one.a_from_b * one.centre;
    one.a_from_b = UnalignedIsometry3d(one.a_from_b.inverse());
  }
  const double p = std::clamp(mode.confidence, 1e-9, 1 - 1e-9);
  one.odds = std::clamp(portable::log(p / (1 - p)), -kMostOfSuggestion, kMostOfSuggestion);
  out[{one.a, one.b}].push_back(one);
}

Between suggestions(const std::vector<Pair>& pairs, const std::vector<RegistrationResult>& results,
                    const std::vector<AuditedPair>& refined, const Islands& islands,
                    const Options& options) {
  Between out;
  for (std::size_t k = 0; k < pairs.size(); ++k) {
    if (!results[k].has_pose()) continue;
    const Eigen::Vector3d centre = overlap_centre(results[k]);
    for (const RegistrationMode& mode : results[k].modes)
      if (mode.confidence >= kLeastSuggested)
        suggest(pairs[k], mode, centre, results[k].flat, islands, options, out);
  }
  for (const AuditedPair& pair : refined) {
    if (pair.shift == 0) continue;
    RegistrationMode mode;
    mode.target_from_source = pair.refined;
    mode.confidence = 0.5;
    suggest({pair.source, pair.target}, mode, pair.overlap_centre, false, islands, options, out);
  }
  return out;
}

bool agree(const Suggestion& x, const Suggestion& y, double distance) {
  return (x.a_from_b.linear() - y.a_from_b.linear()).norm() < kSameTurn &&
         (x.a_from_b * x.centre - y.a_from_b * x.centre).norm() < distance &&
         (x.a_from_b * y.centre - y.a_from_b * y.centre).norm() < distance;
}

/// The suggestions that most others agree with, no two of which agree: indices, the best first.
std::vector<std::size_t> most_agreed(const std::vector<Suggestion>& all, double distance) {
  std::vector<double> support(all.size(), 0);
  for (std::size_t k = 0; k < all.size(); ++k) {
    StopScope::poll();
    for (const Suggestion& other : all)
      if (agree(all[k], other, distance)) support[k] += other.odds + kMostOfSuggestion;
  }
  std::vector<std::size_t> order(all.size()), out;
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::stable_sort(order.begin(), order.end(),
                   [&](std::size_t x, std::size_t y) { return support[x] > support[y]; });
  for (const std::size_t k : order) {
    if (out.size() == kPosesTried) break;
    if (std::none_of(out.begin(), out.end(),
                     [&](std::size_t other) { return agree(all[k], all[other], distance); }))
      out.push_back(k);
  }
  return out;
}

/// Two islands at a suggested pose.
struct Trial {
  const Suggestion* suggestion = nullptr;
  std::vector<UnalignedIsometry3d> poses;  ///< of their scans
  double alone = 0;                        ///< log odds of the surest pair that suggests it
  double odds = 0;                         ///< with what the pairs across say
  std::vector<AuditedPair> across;
  pose_graph::Graph graph;

  UnalignedIsometry3d pose(const Suggestion& of) const {
    return UnalignedIsometry3d(poses[of.target].inverse() * poses[of.source]);
  }
};

/// Solves the graph of a trial.
void solve(std::size_t scans, int threads, Trial& trial) {
  pose_graph::Options options;
  options.threads = threads;
  const pose_graph::Result result = pose_graph::optimize(trial.graph, options);
  trial.poses.assign(scans, no_pose());
  for (std::size_t k = 0; k < trial.graph.nodes.size(); ++k)
    trial.poses[static_cast<std::size_t>(trial.graph.nodes[k].id)] = result.world_from_node[k];
}

/// The scans of both islands where all suggestions that agree put them.
Trial trial_of(const Suggestion& chosen, const std::vector<Suggestion>& all, double distance,
               const Islands& islands, const Options& options) {
  Trial out;
  out.suggestion = &chosen;
  out.alone = chosen.odds;
  std::vector<std::uint32_t> parts(islands.of_scan.size(), kNoIsland);
  for (std::uint32_t k = 0; k < parts.size(); ++k) {
    const std::uint32_t island = islands.of_scan[k];
    if (island != chosen.a && island != chosen.b) continue;
    parts[k] = island;
    const UnalignedIsometry3d& pose = islands.island_from_scan[k];
    out.graph.nodes.push_back({k, island == chosen.a ? pose : chosen.a_from_b * pose});
  }
  for (const Odometry& edge : chains_of(islands.island_from_scan, parts, kShiftWithin, kTurnWithin))
    out.graph.edges.push_back(edge_of(edge));
  for (const Suggestion& other : all) {
    if (!agree(chosen, other, distance)) continue;
    out.alone = std::max(out.alone, other.odds);
    out.graph.edges.push_back(
        edge_of({other.source, other.target, other.target_from_source, other.information}));
  }
  solve(islands.of_scan.size(), options.threads, out);
  return out;
}

/// Judges poses of two islands by the pairs between them.
struct Auditor {
  const Context& context;
  const std::vector<PreparedCloud>& clouds;
  const RegistrationOptions& registration;
  const AuditOptions& options;
  const Islands& islands;
  const Options& reconstruction;

  /// In one batch.
  void judge(std::vector<Trial>& trials) const {
    std::vector<AuditedPair> across;
    std::vector<std::size_t> first;
    for (const Trial& trial : trials) {
      first.push_back(across.size());
      for (const Pair& near : near_pairs(clouds, trial.poses, {}, options.most_pairs)) {
        if (islands.of_scan[near.source] == islands.of_scan[near.target]) continue;
        across.push_back(pair_at(near, trial.poses));
      }
    }
    first.push_back(across.size());
    judge_pairs(context, clouds, registration, options, across);
    for (std::size_t k = 0; k < trials.size(); ++k) {
      Trial& trial = trials[k];
      const auto at = [&](std::size_t pair) {
        return across.begin() + static_cast<std::ptrdiff_t>(pair);
      };
      trial.across.assign(at(first[k]), at(first[k + 1]));
      const std::uint32_t a = trial.suggestion->a;
      trial.odds = trial.alone + log_odds_between(
                                     trial.across,
                                     [&](std::uint32_t scan) { return islands.of_scan[scan] == a; },
                                     trial.poses, options);
    }
  }

  /// Where the pairs that support the pose go by ICP.
  Trial refined(const Trial& trial) const {
    Trial out = trial;
    for (const AuditedPair& pair : trial.across) {
      if (pair.log_likelihood_ratio <= 0) continue;
      RegistrationMode mode;
      mode.target_from_source = pair.refined;
      out.graph.edges.push_back(
          edge_of({pair.source, pair.target, pair.refined,
                   edge_information(mode, pair.overlap_centre, reconstruction.noise,
                                    reconstruction.information_unit)}));
    }
    solve(islands.of_scan.size(), reconstruction.threads, out);
    return out;
  }
};

/// Whether another pose of the same islands is nearly as likely.
bool rivals(const Trial& best, const Trial& other, double distance) {
  const Suggestion& chosen = *best.suggestion;
  if (other.suggestion->a != chosen.a || other.suggestion->b != chosen.b ||
      other.odds < best.odds - kLead)
    return false;
  const UnalignedIsometry3d x = best.pose(chosen), y = other.pose(chosen);
  return (x.translation() - y.translation()).norm() > distance ||
         (x.linear() - y.linear()).norm() > kSameTurn;
}

}  // namespace

std::vector<Odometry> confirmed_joins(const Context& context,
                                      const std::vector<PreparedCloud>& clouds,
                                      const std::vector<Pair>& pairs,
                                      const std::vector<RegistrationResult>& results,
                                      const std::vector<AuditedPair>& refined,
                                      const Reconstruction& map, const Options& reconstruction,
                                      const RegistrationOptions& registration,
                                      const AuditOptions& options) {
  const Islands islands = islands_of(map);
  const double distance = kSameShift * options.max_shift;
  const Between between = suggestions(pairs, results, refined, islands, reconstruction);
  std::vector<Trial> trials;
  for (const auto& [both, all] : between)
    for (const std::size_t k : most_agreed(all, distance))
      trials.push_back(trial_of(all[k], all, distance, islands, reconstruction));
  Auditor auditor{context, clouds, registration, options, islands, reconstruction};
  auditor.judge(trials);
  // The pairs across refine the pose: what contradicts it may go away.
  std::vector<Trial> better;
  for (const Trial& trial : trials)
    if (trial.odds >= kWorthRefining) better.push_back(auditor.refined(trial));
  auditor.judge(better);
  trials.insert(trials.end(), better.begin(), better.end());
  std::stable_sort(trials.begin(), trials.end(),
                   [](const Trial& x, const Trial& y) { return x.odds > y.odds; });
  std::vector<char> asked(map.islands.size(), 0);
  std::vector<Odometry> out;
  for (auto trial = trials.begin(); trial != trials.end() && trial->odds >= kLeastJoined; ++trial) {
    const Suggestion& chosen = *trial->suggestion;
    // Islands that are joined now are asked again, as one.
    if (asked[chosen.a] || asked[chosen.b]) continue;
    asked[chosen.a] = asked[chosen.b] = 1;
    if (std::any_of(trial + 1, trials.end(),
                    [&](const Trial& rival) { return rivals(*trial, rival, distance); }))
      continue;
    out.push_back(odometry_of(chosen.source, chosen.target, trial->pose(chosen), kShift, kTurn));
  }
  return out;
}

}  // namespace gpureg::reconstruction
