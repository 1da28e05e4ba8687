// SPDX-License-Identifier: BSD-3-Clause
#include "reconstruction/audit/path.hpp"

#include <algorithm>
#include <cmath>
#include <map>
#include <set>

#include "common/stop_scope.hpp"
#include "math/trigonometry.hpp"

namespace gpureg::reconstruction {
namespace {

/// Confidence from which a pair would connect scans alone.
constexpr double kConfident = 0.9;
/// Modes of a pair that are asked, and the least confidence of one.
constexpr std::size_t kModes = 4;
constexpr double kLeastOfMode = 0.1;
/// A rival at another pose that is as likely as not.
constexpr double kRival = 0.5;
/// Scans so many numbers apart are as if they had none.
constexpr std::uint32_t kFar = 8;
/// Numbers apart at which pairs may be trusted by themselves.
constexpr std::uint32_t kMostNear = 3;
/// Two of three confident pairs at this distance are more than equal places explain.
constexpr double kGain = 3;
/// Standard deviations by which consecutive scans overlap more often than others.
constexpr double kSignificant = 3;
/// Steps, at least so many, show how far the sensor moves from scan to scan: nine of ten do so by
/// less, and of those that nobody registered some by more.
constexpr std::size_t kLeastSteps = 3;
constexpr double kStepQuantile = 0.9, kLongestStep = 1.5;
/// Poses of one pair that are the same but for drift, metres and degrees.
constexpr double kFitDistance = 0.3, kFitTurn = 6;
/// Islands grow at most so often.
constexpr int kMostPasses = 16;

double degrees(const Eigen::Matrix3d& rotation) {
  return portable::acos(std::clamp((rotation.trace() - 1) / 2, -1.0, 1.0)) /
         portable::kRadiansPerDegree;
}

bool fits(const UnalignedIsometry3d& a, const UnalignedIsometry3d& b) {
  const UnalignedIsometry3d difference = a.inverse() * b;
  return difference.translation().norm() < kFitDistance && degrees(difference.linear()) < kFitTurn;
}

std::uint32_t gap_of(const Pair& pair) {
  return std::max(pair.source, pair.target) - std::min(pair.source, pair.target);
}

double confidence_of(const RegistrationResult& result) {
  return result.has_pose() && !result.modes.empty() ? result.modes.front().confidence : 0;
}

/// Metres from sensor to sensor.
double step_of(const Pair& pair, const UnalignedIsometry3d& target_from_source,
               const std::vector<Eigen::Vector3d>& sensors) {
  return (target_from_source * sensors[pair.source] - sensors[pair.target]).norm();
}

/// What the numbers of the scans tell.
struct Path {
  std::uint32_t near = 0;             ///< pairs of scans so many numbers apart are trusted
  double max_step = 0, max_turn = 0;  ///< from scan to scan, metres and degrees
  bool known = false;
};

double quantile(std::vector<double> values) {
  const auto at =
      static_cast<std::ptrdiff_t>(kStepQuantile * static_cast<double>(values.size() - 1));
  std::nth_element(values.begin(), values.begin() + at, values.end());
  return values[static_cast<std::size_t>(at)];
}

Path path_of(const std::vector<Eigen::Vector3d>& sensors, const std::vector<Pair>& pairs,
             const std::vector<RegistrationResult>& results) {
  struct Count {
    double pairs = 0, confident = 0;
    double share() const { return pairs > 0 ? confident / pairs : 0; }
  };
  const auto scans = static_cast<std::uint32_t>(sensors.size());
  Count far, near[kMostNear];
  std::vector<double> steps, turns;
  for (std::size_t k = 0; k < pairs.size(); ++k) {
    const std::uint32_t gap = gap_of(pairs[k]);
    const bool confident = confidence_of(results[k]) >= kConfident;
    Count* count = gap <= kMostNear                   ? &near[gap - 1]
                   : gap >= std::min(kFar, scans / 2) ? &far
                                                      : nullptr;
    if (count != nullptr) {
      ++count->pairs;
      count->confident += confident;
    }
    if (gap != 1 || !confident) continue;
    const UnalignedIsometry3d& pose = results[k].modes.front().target_from_source;
    steps.push_back(step_of(pairs[k], pose, sensors));
    turns.push_back(degrees(pose.linear()));
  }
  Path path;
  if (far.pairs == 0 || steps.size() < kLeastSteps) return path;
  const double background = std::max(far.share(), 1 / far.pairs);
  path.known = near[0].share() - background >
               kSignificant * std::sqrt(background * (1 - background) / near[0].pairs);
  if (!path.known) return path;
  // At half of the overlaps of consecutive scans, pairs no longer see the same place as a rule.
  while (path.near < kMostNear && near[path.near].share() >= kGain * background &&
         near[path.near].share() >= near[0].share() / 2)
    ++path.near;
  path.max_step = kLongestStep * quantile(std::move(steps));
  path.max_turn = kLongestStep * quantile(std::move(turns));
  return path;
}

/// Where islands would lie to each other by one mode of a pair.
struct Placement {
  double confidence = 0;
  std::size_t pair = 0;
  UnalignedIsometry3d a_from_b;
  UnalignedIsometry3d pose;  ///< of the pair: from the scan in b to the one in a
  std::uint32_t scan_a = 0, scan_b = 0;
};

/// Placements that agree, the most confident first.
struct Join {
  std::uint32_t a = 0, b = 0;
  std::vector<std::size_t> pairs;
  double confidence = 0;  ///< of the best one
  double wrong = 1;       ///< probability that all of them are, as if independent
};

/// Islands, scans that are left out as islands of their own, and how they may grow.
class Growth {
 public:
  Growth(const Reconstruction& map, const Path& path, const std::vector<Eigen::Vector3d>& sensors)
      : path_(path), sensors_(sensors) {
    auto next = static_cast<std::uint32_t>(map.islands.size());
    for (const Scan& scan : map.scans) {
      island_.push_back(scan.placed ? scan.island : next++);
      pose_.push_back(scan.placed ? scan.island_from_scan : UnalignedIsometry3d::Identity());
    }
    scans_.resize(next);
    for (std::uint32_t k = 0; k < island_.size(); ++k) scans_[island_[k]].push_back(k);
  }

  /// Trusts pairs that agree with the islands, and those that join two of them.
  /// @return whether there were any.
  bool grow(const std::vector<Pair>& pairs, const std::vector<RegistrationResult>& results,
            std::vector<char>& trusted) {
    bool grown = false;
    std::map<std::pair<std::uint32_t, std::uint32_t>, std::vector<Placement>> between;
    for (std::size_t k = 0; k < pairs.size(); ++k) {
      if (trusted[k] || !results[k].has_pose()) continue;
      const std::uint32_t s = pairs[k].source, t = pairs[k].target;
      const std::vector<RegistrationMode>& modes = results[k].modes;
      for (std::size_t m = 0; m < std::min(kModes, modes.size()); ++m) {
        if (modes[m].confidence < kLeastOfMode) continue;
        const UnalignedIsometry3d& pose = modes[m].target_from_source;
        if (island_[s] != island_[t])
          add(modes[m].confidence, k, s, t, pose, between);
        else if (m == 0 && fits(pose_[t].inverse() * pose_[s], pose))
          trusted[k] = grown = true;
      }
    }
    std::set<std::uint32_t> joined;
    for (const Join& join : joins(std::move(between))) {
      if (joined.count(join.a) || joined.count(join.b)) continue;
      joined.insert({join.a, join.b});
      for (const std::size_t k : join.pairs) trusted[k] = grown = true;
    }
    return grown;
  }

 private:
  void add(
      double confidence, std::size_t pair, std::uint32_t s, std::uint32_t t,
      const UnalignedIsometry3d& target_from_source,
      std::map<std::pair<std::uint32_t, std::uint32_t>, std::vector<Placement>>& between) const {
    Placement p;
    p.confidence = confidence;
    p.pair = pair;
    const bool straight = island_[t] < island_[s];
    p.scan_a = straight ? t : s;
    p.scan_b = straight ? s : t;
    p.pose = straight ? target_from_source : UnalignedIsometry3d(target_from_source.inverse());
    p.a_from_b = pose_[p.scan_a] * p.pose * pose_[p.scan_b].inverse();
    between[{island_[p.scan_a], island_[p.scan_b]}].push_back(p);
  }

  /// Whether scans that follow each other come to lie beside each other, always, and at least once
  /// without an unusual turn.
  bool continues(const Placement& p) const {
    const std::uint32_t a = island_[p.scan_a], b = island_[p.scan_b];
    const bool fewer = scans_[a].size() < scans_[b].size();
    bool any = false;
    for (const std::uint32_t k : scans_[fewer ? a : b])
      for (const std::uint32_t next : {k - 1, k + 1}) {
        if (next >= island_.size() || island_[next] != (fewer ? b : a)) continue;
        const std::uint32_t in_a = fewer ? k : next, in_b = fewer ? next : k;
        const UnalignedIsometry3d here = p.a_from_b * pose_[in_b];
        if ((here * sensors_[in_b] - pose_[in_a] * sensors_[in_a]).norm() > path_.max_step)
          return false;
        any |= degrees(pose_[in_a].linear().transpose() * here.linear()) <= path_.max_turn;
      }
    return any;
  }

  /// Joins without a rival, the surest first.
  std::vector<Join> joins(
      std::map<std::pair<std::uint32_t, std::uint32_t>, std::vector<Placement>> between) const {
    std::vector<Join> out;
    for (auto& [islands, placements] : between) {
      StopScope::poll();
      std::stable_sort(
          placements.begin(), placements.end(),
          [](const Placement& x, const Placement& y) { return x.confidence > y.confidence; });
      std::vector<Join> here;
      std::set<std::size_t> used;
      for (const Placement& seed : placements) {
        if (used.count(seed.pair)) continue;
        const Join join = around(seed, placements, used);
        if (continues(seed)) here.push_back(join);
      }
      const bool rival = here.size() > 1 && here[1].confidence >= kRival;
      if (!here.empty() && !rival && here[0].confidence >= kConfident) out.push_back(here[0]);
    }
    std::stable_sort(out.begin(), out.end(),
                     [](const Join& x, const Join& y) { return x.wrong < y.wrong; });
    return out;
  }

  Join around(const Placement& seed, const std::vector<Placement>& placements,
              std::set<std::size_t>& used) const {
    Join join;
    join.a = island_[seed.scan_a];
    join.b = island_[seed.scan_b];
    join.confidence = seed.confidence;
    for (const Placement& p : placements) {
      const UnalignedIsometry3d implied =
          pose_[p.scan_a].inverse() * seed.a_from_b * pose_[p.scan_b];
      if (used.count(p.pair) || !fits(implied, p.pose)) continue;
      used.insert(p.pair);
      join.pairs.push_back(p.pair);
      join.wrong *= 1 - std::min(p.confidence, 1 - 1e-9);
    }
    return join;
  }

  const Path& path_;
  const std::vector<Eigen::Vector3d>& sensors_;
  std::vector<std::uint32_t> island_;              ///< of each scan
  std::vector<UnalignedIsometry3d> pose_;          ///< island_from_scan
  std::vector<std::vector<std::uint32_t>> scans_;  ///< of each island
};

}  // namespace

double jumps_along_the_path(const Reconstruction& map, const std::vector<Eigen::Vector3d>& sensors,
                            const std::vector<Pair>& pairs,
                            const std::vector<RegistrationResult>& results) {
  const Path path = path_of(sensors, pairs, results);
  if (!path.known) return 0;
  double steps = 0, jumps = 0;
  for (std::uint32_t k = 1; k < map.scans.size(); ++k) {
    const Scan &a = map.scans[k - 1], &b = map.scans[k];
    if (!a.placed || !b.placed || a.island != b.island) continue;
    ++steps;
    jumps += step_of({k, k - 1}, a.island_from_scan.inverse() * b.island_from_scan, sensors) >
             path.max_step;
  }
  return steps > 0 ? jumps / steps : 0;
}

std::optional<std::vector<char>> pairs_along_the_path(
    const std::vector<Eigen::Vector3d>& sensors, const std::vector<Pair>& pairs,
    const std::vector<RegistrationResult>& results, const Options& options) {
  const Path path = path_of(sensors, pairs, results);
  if (!path.known) return std::nullopt;
  std::vector<char> trusted(pairs.size(), 1);
  for (std::size_t k = 0; k < pairs.size(); ++k)
    trusted[k] = gap_of(pairs[k]) <= path.near && results[k].has_pose() &&
                 step_of(pairs[k], results[k].target_from_source, sensors) <=
                     gap_of(pairs[k]) * path.max_step;
  std::vector<RegistrationResult> of_trusted = results;
  for (int round = 0; round < kMostPasses; ++round) {
    for (std::size_t k = 0; k < results.size(); ++k)
      of_trusted[k].target_from_source = trusted[k] ? results[k].target_from_source : no_pose();
    const Reconstruction map = reconstruct_from_poses(sensors.size(), pairs, of_trusted, options);
    if (!Growth(map, path, sensors).grow(pairs, results, trusted)) break;
  }
  return trusted;
}

}  // namespace gpureg::reconstruction
