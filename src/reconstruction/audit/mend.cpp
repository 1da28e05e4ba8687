// SPDX-License-Identifier: BSD-3-Clause
#include "gpureg/reconstruction/mend.hpp"

#include <algorithm>
#include <iterator>
#include <map>
#include <set>
#include <string>

#include "fields/in_units.hpp"
#include "fields/reconstruction.hpp"
#include "gpureg/error.hpp"
#include "gpureg/reconstruction.hpp"
#include "reconstruction/audit/in_units.hpp"
#include "reconstruction/audit/joins.hpp"
#include "reconstruction/audit/near_pairs.hpp"
#include "reconstruction/audit/parts.hpp"
#include "reconstruction/audit/stoppable.hpp"
#include "reconstruction/odometry.hpp"

namespace gpureg::reconstruction {
namespace {

/// Pairs of one scan that are aligned with scans of other parts.
constexpr std::size_t kPairsOfScan = 24;
/// Scans at either side of a break that are aligned, by their number in the set.
constexpr std::uint32_t kBeside = 4;
/// Within a part poses are right, from scan to scan up to so many metres and radians.
constexpr double kOfPart = 0.999, kShiftOfPart = 0.005, kTurnOfPart = 0.002;
/// Shift from which a scan has another pose, metres, and the same for the entries of its rotation.
constexpr double kMoved = 0.02;
/// Pairs are aligned at most so often.
constexpr int kMostAlignments = 3;

/// Poses within the parts.
std::vector<Odometry> held(const std::vector<UnalignedIsometry3d>& poses, const Parts& parts) {
  std::vector<Odometry> out = chains_of(poses, parts, kShiftOfPart, kTurnOfPart);
  for (Odometry& edge : out) edge.confidence = kOfPart;
  return out;
}

/// Pairs of different parts that may see each other: neighbours by number, those that were near at
/// the wrong poses, and of a small part as many others as it may have, evenly chosen.
std::vector<Pair> pairs_to_align(const Parts& parts, const Audit& found) {
  std::set<std::pair<std::uint32_t, std::uint32_t>> chosen;
  std::vector<std::size_t> count(parts.size(), 0);
  const auto add = [&](std::uint32_t a, std::uint32_t b) {
    if (parts[a] == parts[b] || parts[a] == kNoPart || parts[b] == kNoPart) return;
    if (std::min(count[a], count[b]) >= kPairsOfScan) return;
    if (!chosen.insert(std::minmax(a, b)).second) return;
    ++count[a];
    ++count[b];
  };
  const auto scans = static_cast<std::uint32_t>(parts.size());
  for (std::uint32_t k = 0; k < scans; ++k)
    for (std::uint32_t m = k + 1; m < std::min(scans, k + 1 + kBeside); ++m) add(k, m);
  for (const AuditedPair& pair : found.pairs) add(pair.source, pair.target);
  std::map<std::uint32_t, std::size_t> sizes;
  for (const std::uint32_t part : parts) ++sizes[part];
  for (std::uint32_t k = 0; k < scans; ++k) {
    if (parts[k] == kNoPart || 4 * sizes[parts[k]] > parts.size()) continue;
    const std::uint32_t step =
        std::max<std::uint32_t>(1, scans / static_cast<std::uint32_t>(kPairsOfScan));
    for (std::uint32_t m = k % step; m < scans; m += step) add(k, m);
  }
  std::vector<Pair> out;
  for (const auto& [low, high] : chosen) out.push_back({high, low});
  return out;
}

/// Pairs of different parts that see each other at the mended poses.
std::vector<Pair> pairs_between(const std::vector<PreparedCloud>& clouds, const Parts& parts,
                                const std::vector<UnalignedIsometry3d>& poses,
                                const std::vector<Pair>& known, std::uint32_t most) {
  std::set<std::pair<std::uint32_t, std::uint32_t>> seen;
  for (const Pair& pair : known) seen.insert(std::minmax(pair.source, pair.target));
  std::vector<Pair> out;
  for (const Pair& pair : near_pairs(clouds, poses, {}, most))
    if (parts[pair.source] != parts[pair.target] &&
        seen.insert(std::minmax(pair.source, pair.target)).second)
      out.push_back(pair);
  return out;
}

/// The island with the most scans goes where its first scan was.
void place(const Reconstruction& map, const std::vector<UnalignedIsometry3d>& before,
           MendedMap& out) {
  out.world_from_scan.assign(before.size(), no_pose());
  if (!map.islands.empty()) {
    const std::vector<std::uint32_t>& scans = map.islands.front().scans;
    // Of the part that is largest in it, a scan in the middle: what moved is the smaller part.
    std::map<std::uint32_t, std::size_t> agree;
    for (const std::uint32_t anchor : scans) {
      const UnalignedIsometry3d world_from_island =
          before[anchor] * map.scans[anchor].island_from_scan.inverse();
      for (const std::uint32_t scan : scans)
        agree[anchor] += (world_from_island * map.scans[scan].island_from_scan.translation() -
                          before[scan].translation())
                             .norm() < 10 * kMoved;
    }
    const std::uint32_t anchor =
        std::max_element(agree.begin(), agree.end(), [](const auto& a, const auto& b) {
          return a.second < b.second;
        })->first;
    const UnalignedIsometry3d world_from_island =
        before[anchor] * map.scans[anchor].island_from_scan.inverse();
    for (const std::uint32_t scan : scans)
      out.world_from_scan[scan] = world_from_island * map.scans[scan].island_from_scan;
  }
}

/// Scans that have another pose, and none any more.
void list_changes(const std::vector<UnalignedIsometry3d>& before, MendedMap& out) {
  for (std::uint32_t k = 0; k < before.size(); ++k) {
    if (!before[k].matrix().allFinite()) continue;
    if (!out.world_from_scan[k].matrix().allFinite())
      out.left_out.push_back(k);
    else if ((out.world_from_scan[k].matrix() - before[k].matrix()).cwiseAbs().maxCoeff() > kMoved)
      out.moved.push_back(k);
  }
}

/// Takes the map apart, and puts the parts together.
MendedMap put_together(const Context& context, const std::vector<PreparedCloud>& clouds,
                       const std::vector<UnalignedIsometry3d>& poses, const Audit& found,
                       const RegistrationOptions& registration, const AuditOptions& options) {
  MendedMap out;
  out.world_from_scan = poses;
  Parts parts = parts_without_few(context, clouds, poses, found, registration, options);
  if (parts.empty()) parts = parts_of(poses, found);
  const Options reconstruction{registration.voxel_size},
      lengths = fields::in_units(reconstruction, reconstruction.voxel_size);
  std::vector<Pair> pairs, more = pairs_to_align(parts, found);
  std::vector<RegistrationResult> results;
  std::vector<Odometry> odometry = held(poses, parts);
  // Few pairs see each other where the parts were; where they belong, more pairs hold them.
  for (int pass = 0; pass < kMostAlignments && !more.empty(); ++pass) {
    std::vector<RegistrationResult> aligned = align_batch(context, clouds, more, registration);
    pairs.insert(pairs.end(), more.begin(), more.end());
    std::move(aligned.begin(), aligned.end(), std::back_inserter(results));
    AuditedReconstruction again = reconstruct_in_units(
        context, clouds, pairs, results, reconstruction, odometry, registration, options);
    const std::vector<Odometry> joins = confirmed_joins(
        context, clouds, pairs, results, found.pairs, again.map, lengths, registration, options);
    if (!joins.empty()) {
      odometry.insert(odometry.end(), joins.begin(), joins.end());
      again = reconstruct_in_units(context, clouds, pairs, results, reconstruction, odometry,
                                   registration, options);
    }
    place(again.map, poses, out);
    more = pairs_between(clouds, parts, out.world_from_scan, pairs, kPairsOfScan);
  }
  out.registered = pairs.size();
  return out;
}

/// The part of an audit that is about one island.
Audit of_island(const Audit& found, std::uint32_t island) {
  Audit out;
  out.islands.resize(island + 1);
  out.islands[island] = found.islands[island];
  const std::vector<std::uint32_t>& scans = out.islands[island].scans;
  std::vector<std::size_t> place(found.pairs.size());
  for (std::size_t k = 0; k < found.pairs.size(); ++k) {
    if (!std::binary_search(scans.begin(), scans.end(), found.pairs[k].source)) continue;
    place[k] = out.pairs.size();
    out.pairs.push_back(found.pairs[k]);
  }
  std::vector<std::size_t> before(found.order.size() + 1, 0);
  for (std::size_t k = 0; k < found.order.size(); ++k) {
    const bool here = std::binary_search(scans.begin(), scans.end(), found.order[k]);
    before[k + 1] = before[k] + here;
    if (here) out.order.push_back(found.order[k]);
  }
  for (AuditedConnection connection : found.connections) {
    if (connection.island != island) continue;
    connection.first = before[connection.first];
    for (std::size_t& k : connection.contradictions) k = place[k];
    out.connections.push_back(std::move(connection));
  }
  return out;
}

/// What an audit of the mended map contradicts has no pose any more.
void leave_out_contradicted(const Context& context, const std::vector<PreparedCloud>& clouds,
                            const std::vector<std::uint32_t>& islands,
                            const RegistrationOptions& registration, const AuditOptions& options,
                            MendedMap& map) {
  for (;;) {
    map.audit = audit_in_units(context, clouds, map_of_poses(map.world_from_scan, islands),
                               registration, options);
    if (map.audit.verdict() != AuditVerdict::contradicted) return;
    // The worst connection: others may be contradicted because of it.
    for (const std::uint32_t scan : map.audit.scans_of(map.audit.connections.front()))
      map.world_from_scan[scan] = no_pose();
  }
}

/// mend(), within its should_stop.
MendedMap mend_islands(const Context& context, const std::vector<PreparedCloud>& clouds,
                       const Reconstruction& map, const Audit& found,
                       const RegistrationOptions& registration, const AuditOptions& options) {
  std::vector<UnalignedIsometry3d> poses;
  std::vector<std::uint32_t> islands;
  for (const Scan& scan : map.scans) {
    poses.push_back(scan.placed ? scan.island_from_scan : no_pose());
    islands.push_back(scan.placed ? scan.island : 0);
  }
  MendedMap out;
  out.world_from_scan = poses;
  out.audit = found;
  if (found.verdict() != AuditVerdict::contradicted) return out;
  const std::vector<AuditVerdict> verdicts = found.verdicts();
  for (std::uint32_t island = 0; island < verdicts.size(); ++island) {
    if (verdicts[island] != AuditVerdict::contradicted) continue;
    std::vector<UnalignedIsometry3d> alone(poses.size(), no_pose());
    for (const std::uint32_t scan : found.islands[island].scans) alone[scan] = poses[scan];
    const MendedMap mended =
        put_together(context, clouds, alone, of_island(found, island), registration, options);
    for (const std::uint32_t scan : found.islands[island].scans)
      out.world_from_scan[scan] = mended.world_from_scan[scan];
    out.registered += mended.registered;
  }
  leave_out_contradicted(context, clouds, islands, registration, options, out);
  list_changes(poses, out);
  return out;
}

}  // namespace

MendedMap mend(const Context& context, const std::vector<PreparedCloud>& clouds,
               const Reconstruction& map, const Audit& found,
               const RegistrationOptions& registration, const AuditOptions& given) {
  const AuditOptions options = in_units(given, registration.voxel_size);
  if (map.scans.size() != clouds.size())
    throw InvalidArgument("world_from_scan has " + std::to_string(map.scans.size()) +
                          " entries, expected one per cloud, " + std::to_string(clouds.size()));
  return stoppable(
      options, [&] { return mend_islands(context, clouds, map, found, registration, options); });
}

MendedMap mend(const Context& context, const std::vector<PreparedCloud>& clouds,
               const std::vector<UnalignedIsometry3d>& world_from_scan, const Audit& found,
               const RegistrationOptions& registration, const AuditOptions& options) {
  return mend(context, clouds, map_of_poses(world_from_scan), found, registration, options);
}

}  // namespace gpureg::reconstruction
