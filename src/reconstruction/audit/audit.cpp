// SPDX-License-Identifier: BSD-3-Clause
#include "gpureg/reconstruction/audit.hpp"

#include <algorithm>
#include <cmath>
#include <map>
#include <set>
#include <string>

#include "common/for_each_on.hpp"
#include "common/rigid.hpp"
#include "common/validate.hpp"
#include "fields/audit.hpp"
#include "fields/in_units.hpp"
#include "fields/validate.hpp"
#include "gpureg/error.hpp"
#include "gpureg/reconstruction.hpp"
#include "reconstruction/audit/alike_model.hpp"
#include "reconstruction/audit/blame.hpp"
#include "reconstruction/audit/companions.hpp"
#include "reconstruction/audit/edge_confidence.hpp"
#include "reconstruction/audit/in_units.hpp"
#include "reconstruction/audit/near_pairs.hpp"
#include "reconstruction/audit/pair_verdicts.hpp"
#include "reconstruction/audit/path.hpp"
#include "reconstruction/audit/stoppable.hpp"

namespace gpureg::reconstruction {
namespace {

/// Edges are taken out and the graph solved again at most so often.
constexpr int kMostRounds = 12;
/// A mode below takes no part.
constexpr double kLeastPossible = 0.02;

void check_poses(const std::vector<PreparedCloud>& clouds,
                 const std::vector<UnalignedIsometry3d>& world_from_scan) {
  if (world_from_scan.size() != clouds.size())
    throw InvalidArgument("world_from_scan has " + std::to_string(world_from_scan.size()) +
                          " entries, expected one per cloud, " + std::to_string(clouds.size()));
  for (std::size_t k = 0; k < world_from_scan.size(); ++k) {
    const UnalignedIsometry3d& pose = world_from_scan[k];
    if (!pose.matrix().allFinite()) continue;
    require_rigid(pose, "world_from_scan[" + std::to_string(k) + "]");
  }
}

/// Two poses are the same to a verdict: metres, and of the entries of the rotation.
constexpr double kSameDistance = 0.01, kSameRotation = 0.005;

bool same(const UnalignedIsometry3d& a, const UnalignedIsometry3d& b) {
  return (a.translation() - b.translation()).norm() < kSameDistance &&
         (a.linear() - b.linear()).cwiseAbs().maxCoeff() < kSameRotation;
}

/// judge_pairs(), but for pairs that an earlier audit judged at the same pose.
void judge_new_pairs(const Context& context, const std::vector<PreparedCloud>& clouds,
                     const RegistrationOptions& registration, const AuditOptions& options,
                     const Audit& before, std::vector<AuditedPair>& pairs) {
  if (before.pairs.empty()) return judge_pairs(context, clouds, registration, options, pairs);
  std::map<std::pair<std::uint32_t, std::uint32_t>, const AuditedPair*> known;
  for (const AuditedPair& pair : before.pairs) known[{pair.source, pair.target}] = &pair;
  std::vector<AuditedPair> asked;
  std::vector<std::size_t> asked_for;
  for (std::size_t k = 0; k < pairs.size(); ++k) {
    const auto at = known.find({pairs[k].source, pairs[k].target});
    if (at != known.end() && same(at->second->target_from_source, pairs[k].target_from_source)) {
      pairs[k] = *at->second;
      continue;
    }
    asked.push_back(pairs[k]);
    asked_for.push_back(k);
  }
  judge_pairs(context, clouds, registration, options, asked);
  for (std::size_t k = 0; k < asked.size(); ++k) pairs[asked_for[k]] = asked[k];
}

Audit audit_of(const Context& context, const std::vector<PreparedCloud>& clouds,
               const std::vector<UnalignedIsometry3d>& world_from_scan,
               const std::vector<std::uint32_t>& islands, const std::vector<Bond>& bonds,
               const RegistrationOptions& registration, const AuditOptions& options,
               const Audit& before = {}) {
  Audit out;
  for (const Pair& near : near_pairs(clouds, world_from_scan, islands, options.most_pairs)) {
    out.pairs.push_back(pair_at(near, world_from_scan));
  }
  judge_new_pairs(context, clouds, registration, options, before, out.pairs);
  judge_connections(islands, bonds, world_from_scan, options, out);
  return out;
}

Audit audit_of(const Context& context, const std::vector<PreparedCloud>& clouds,
               const Reconstruction& map, const RegistrationOptions& registration,
               const AuditOptions& options, const Audit& before) {
  options.validate();
  std::vector<UnalignedIsometry3d> poses;
  std::vector<std::uint32_t> islands;
  for (const Scan& scan : map.scans) {
    poses.push_back(scan.placed ? scan.island_from_scan : no_pose());
    islands.push_back(scan.placed ? scan.island : kNoIsland);
  }
  check_poses(clouds, poses);
  std::vector<Bond> bonds;
  for (const Edge& edge : map.edges)
    if (edge.accepted && map.scans[edge.source].placed)
      bonds.push_back({edge.source, edge.target, edge.confidence});
  for (const Odometry& edge : map.odometry)
    if (map.scans[edge.source].placed) bonds.push_back({edge.source, edge.target, 1});
  return audit_of(context, clouds, poses, islands, bonds, registration, options, before);
}

/// Whether a pair lies across the connection that a part has with the others.
bool divides(const std::vector<std::uint32_t>& part, std::uint32_t a, std::uint32_t b) {
  return std::binary_search(part.begin(), part.end(), a) !=
         std::binary_search(part.begin(), part.end(), b);
}

bool held_by_odometry(const std::vector<std::uint32_t>& part,
                      const std::vector<Odometry>& odometry) {
  return std::any_of(odometry.begin(), odometry.end(),
                     [&](const Odometry& edge) { return divides(part, edge.source, edge.target); });
}

/// The results, of each the modes up to the last that may still take part: what is left out is most
/// of the memory of a large set. Confidences only fall from here on.
std::vector<RegistrationResult> with_likely_modes(const std::vector<RegistrationResult>& results,
                                                  const Options& options) {
  const double least = std::min(kLeastPossible, options.consistency.min_alternative_confidence);
  std::vector<RegistrationResult> out(results.size());
  const auto copy = [&](std::size_t k) {
    RegistrationResult one = results[k];
    std::size_t kept = one.modes.size();
    // What is no mode stays, and is named where the results are checked.
    const auto unlikely = [&](const RegistrationMode& mode) {
      return mode.confidence >= 0 && mode.confidence < least &&
             why_not_rigid(mode.target_from_source.matrix()).empty();
    };
    while (kept > 1 && unlikely(one.modes[kept - 1])) --kept;
    one.modes.resize(kept);
    one.modes.shrink_to_fit();
    out[k] = std::move(one);
  };
  for_each_on(static_cast<std::size_t>(thread_count(options.threads)), out.size(), copy);
  return out;
}

/// A mode that the audit has ruled out takes no part any more.
void rule_out(const Edge& edge, std::vector<RegistrationResult>& results) {
  RegistrationResult& result = results[edge.pair];
  if (edge.mode < result.modes.size()) result.modes[edge.mode].confidence = 0;
  const bool none =
      std::all_of(result.modes.begin(), result.modes.end(),
                  [](const RegistrationMode& mode) { return mode.confidence < kLeastPossible; });
  if (none) result.target_from_source = no_pose();
}

/// Mean of the viewpoints of each scan.
std::vector<Eigen::Vector3d> sensors_of(const std::vector<PreparedCloud>& clouds) {
  std::vector<Eigen::Vector3d> out(clouds.size(), Eigen::Vector3d::Zero());
  for (std::size_t k = 0; k < clouds.size(); ++k) {
    if (!clouds[k].valid()) continue;
    const std::vector<Eigen::Vector3f> viewpoints = clouds[k].viewpoints();
    for (const Eigen::Vector3f& viewpoint : viewpoints) out[k] += viewpoint.cast<double>();
    out[k] = out[k] / static_cast<double>(viewpoints.size()) + clouds[k].origin();
  }
  return out;
}

/// Takes the pairs out that are not trusted where places look alike.
/// @param trusted of pairs_along_the_path().
/// @return them as rejected edges.
std::vector<Edge> keep_to_the_path(const std::vector<char>& trusted, const std::vector<Pair>& pairs,
                                   const Options& options,
                                   std::vector<RegistrationResult>& results) {
  std::vector<Edge> out;
  for (std::size_t k = 0; k < pairs.size(); ++k) {
    if (trusted[k] || !results[k].has_pose() || results[k].modes.empty()) continue;
    results[k].target_from_source = no_pose();
    const RegistrationMode& mode = results[k].modes.front();
    if (mode.confidence < options.min_edge_confidence) continue;
    Edge edge;
    edge.source = pairs[k].source;
    edge.target = pairs[k].target;
    edge.pair = k;
    edge.target_from_source = mode.target_from_source;
    edge.confidence = edge.pair_confidence = edge.map_confidence = mode.confidence;
    edge.reason = EdgeReason::unconfirmed;
    out.push_back(edge);
  }
  return out;
}

/// Where places look alike and no path tells them apart, agreement says nothing: a scan agrees with
/// all copies of its place. What is left is what a pair is worth by itself, among copies.
void hear_each_pair_alone(std::vector<RegistrationResult>& results, Options& options) {
  options.consistency.max_odds_factor = 1;
  for (RegistrationResult& result : results) {
    for (RegistrationMode& mode : result.modes)
      mode.confidence = confidence_among_copies(mode.confidence);
    result.confidence = result.modes.empty() ? confidence_among_copies(result.confidence)
                                             : result.modes.front().confidence;
  }
}

/// Edges of `ruled_out` that the map lacks, as rejected ones.
void add_ruled_out(const std::vector<Edge>& ruled_out, Reconstruction& map) {
  std::set<std::size_t> known;
  for (const Edge& edge : map.edges) known.insert(edge.pair);
  for (const Edge& edge : ruled_out) {
    for (const std::uint32_t scan : {edge.source, edge.target})
      if (map.scans[scan].reason == ScanReason::no_confident_pair)
        map.scans[scan].reason = ScanReason::unconfirmed;
    if (known.insert(edge.pair).second) map.edges.push_back(edge);
  }
  std::stable_sort(map.edges.begin(), map.edges.end(),
                   [](const Edge& a, const Edge& b) { return a.pair < b.pair; });
}

}  // namespace

const char* to_string(PairVerdict verdict) {
  switch (verdict) {
    case PairVerdict::silent:
      return "silent";
    case PairVerdict::supports:
      return "supports";
    case PairVerdict::contradicts:
      return "contradicts";
  }
  return "unknown";
}

const char* to_string(ConnectionVerdict verdict) {
  switch (verdict) {
    case ConnectionVerdict::undecided:
      return "undecided";
    case ConnectionVerdict::confirmed:
      return "confirmed";
    case ConnectionVerdict::contradicted:
      return "contradicted";
  }
  return "unknown";
}

const char* to_string(AuditVerdict verdict) {
  switch (verdict) {
    case AuditVerdict::undecided:
      return "undecided";
    case AuditVerdict::sound:
      return "sound";
    case AuditVerdict::contradicted:
      return "contradicted";
  }
  return "unknown";
}

AuditOptions in_units(const AuditOptions& options, float voxel_size) {
  options.validate();
  AuditOptions out = fields::in_units(options, voxel_size);
  const double factor = static_cast<double>(voxel_size) / 0.05;
  // Coarse voxels suit large scenes, not worse sensors: ICP places LiDAR scans to decimetres.
  if (factor > 1) out.max_shift /= std::sqrt(factor * std::sqrt(factor));
  return out;
}

void AuditOptions::validate() const {
  fields::validate(*this);
  require(max_contradicted < min_confirmed, "max_contradicted", max_contradicted,
          "less than min_confirmed");
}

std::vector<AuditVerdict> Audit::verdicts() const {
  std::vector<AuditVerdict> out(islands.size(), AuditVerdict::undecided);
  std::vector<std::size_t> confirmed(islands.size(), 0), undecided(islands.size(), 0);
  for (const AuditedConnection& connection : connections) {
    confirmed[connection.island] += connection.verdict == ConnectionVerdict::confirmed;
    undecided[connection.island] += connection.verdict == ConnectionVerdict::undecided;
    if (connection.verdict == ConnectionVerdict::contradicted)
      out[connection.island] = AuditVerdict::contradicted;
  }
  // Of right maps at most one connection of six was undecided.
  for (std::size_t k = 0; k < out.size(); ++k)
    if (out[k] != AuditVerdict::contradicted && confirmed[k] > undecided[k])
      out[k] = AuditVerdict::sound;
  return out;
}

AuditVerdict Audit::verdict() const {
  const std::vector<AuditVerdict> all = verdicts();
  bool any = false, sound = true;
  for (std::size_t k = 0; k < all.size(); ++k) {
    if (all[k] == AuditVerdict::contradicted) return AuditVerdict::contradicted;
    if (islands[k].scans.size() < 2) continue;  // without a connection
    any = true;
    sound &= all[k] == AuditVerdict::sound;
  }
  return any && sound ? AuditVerdict::sound : AuditVerdict::undecided;
}

std::vector<std::uint32_t> Audit::scans_of(const AuditedConnection& connection) const {
  const auto begin = order.begin() + static_cast<std::ptrdiff_t>(connection.first);
  std::vector<std::uint32_t> out(begin, begin + static_cast<std::ptrdiff_t>(connection.size));
  std::sort(out.begin(), out.end());
  return out;
}

std::size_t Audit::count(PairVerdict verdict) const {
  return static_cast<std::size_t>(
      std::count_if(pairs.begin(), pairs.end(),
                    [&](const AuditedPair& pair) { return pair.verdict == verdict; }));
}

std::size_t Audit::count(ConnectionVerdict verdict) const {
  return static_cast<std::size_t>(std::count_if(
      connections.begin(), connections.end(),
      [&](const AuditedConnection& connection) { return connection.verdict == verdict; }));
}

AuditedReconstruction reconstruct_in_units(
    const Context& context, const std::vector<PreparedCloud>& clouds,
    const std::vector<Pair>& pairs, const std::vector<RegistrationResult>& results,
    const Options& given, const std::vector<Odometry>& odometry,
    const RegistrationOptions& registration, const AuditOptions& audit_options) {
  Options options = given;
  options.voxel_size = registration.voxel_size;
  AuditedReconstruction out;
  std::vector<RegistrationResult> left = with_likely_modes(results, options);
  std::vector<Edge> ruled_out;
  const std::vector<Eigen::Vector3d> sensors = sensors_of(clouds);
  Agreement agreement;
  if (odometry.empty()) {
    const Reconstruction map = reconstruct_from_poses(clouds.size(), pairs, left, options);
    agreement = map.agreement;
    agreement.jumps = jumps_along_the_path(map, sensors, pairs, left);
    out.places_look_alike = alike_log_odds(agreement) > 0;
  }
  bool heard_alone = false;
  if (out.places_look_alike) {
    if (const auto trusted = pairs_along_the_path(sensors, pairs, left, options)) {
      ruled_out = keep_to_the_path(*trusted, pairs, options, left);
    } else {
      hear_each_pair_alone(left, options);
      heard_alone = true;
    }
  }
  hear_companions(context, clouds, pairs, registration, audit_options, left);
  for (int round = 0;; ++round) {
    out.map = reconstruct_from_poses(clouds.size(), pairs, left, options, odometry);
    out.audit = audit_of(context, clouds, out.map, registration, audit_options, out.audit);
    bool changed = false;
    // The worst connection of each island: others may be contradicted because of it.
    std::set<std::uint32_t> judged;
    for (const AuditedConnection& connection : out.audit.connections) {
      if (round == kMostRounds || connection.verdict != ConnectionVerdict::contradicted) break;
      const std::vector<std::uint32_t> part = out.audit.scans_of(connection);
      if (held_by_odometry(part, odometry) ||
          !judged.insert(out.map.scans[part.front()].island).second)
        continue;
      for (const Edge& edge : out.map.edges) {
        if (!edge.accepted || !divides(part, edge.source, edge.target)) continue;
        rule_out(edge, left);
        ruled_out.push_back(edge);
        ruled_out.back().accepted = false;
        ruled_out.back().weight = 0;
        ruled_out.back().reason = EdgeReason::inconsistent;
        changed = true;
      }
    }
    if (!changed) break;
  }
  add_ruled_out(ruled_out, out.map);
  if (odometry.empty()) out.map.agreement = agreement;
  judge_edges(out.audit, audit_options, out.places_look_alike, out.map);
  if (heard_alone)
    for (Edge& edge : out.map.edges)
      edge.map_confidence = std::min(edge.map_confidence, edge.confidence);
  return out;
}

Audit audit_in_units(const Context& context, const std::vector<PreparedCloud>& clouds,
                     const Reconstruction& map, const RegistrationOptions& registration,
                     const AuditOptions& options) {
  return audit_of(context, clouds, map, registration, options, {});
}

Audit audit(const Context& context, const std::vector<PreparedCloud>& clouds,
            const std::vector<UnalignedIsometry3d>& world_from_scan,
            const RegistrationOptions& registration, const AuditOptions& options) {
  return audit(context, clouds, map_of_poses(world_from_scan), registration, options);
}

Audit audit(const Context& context, const std::vector<PreparedCloud>& clouds,
            const Reconstruction& map, const RegistrationOptions& registration,
            const AuditOptions& options) {
  const AuditOptions lengths = in_units(options, registration.voxel_size);
  return stoppable(options,
                   [&] { return audit_in_units(context, clouds, map, registration, lengths); });
}

AuditedReconstruction reconstruct(const Context& context, const std::vector<PreparedCloud>& clouds,
                                  const std::vector<Pair>& pairs,
                                  const std::vector<RegistrationResult>& results,
                                  const Options& options, const std::vector<Odometry>& odometry,
                                  const RegistrationOptions& registration,
                                  const AuditOptions& audit_options) {
  const AuditOptions lengths = in_units(audit_options, registration.voxel_size);
  return stoppable(audit_options, [&] {
    return reconstruct_in_units(context, clouds, pairs, results, options, odometry, registration,
                                lengths);
  });
}

}  // namespace gpureg::reconstruction
