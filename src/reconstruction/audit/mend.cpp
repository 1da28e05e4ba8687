// SPDX-License-Identifier: BSD-3-Clause
#include "gpureg/reconstruction/mend.hpp"

#include <algorithm>
#include <iterator>
#include <map>
#include <numeric>
#include <set>
#include <string>
#include <tuple>

#include "gpureg/error.hpp"
#include "reconstruction/audit/joins.hpp"
#include "reconstruction/audit/near_pairs.hpp"
#include "reconstruction/odometry.hpp"

namespace gpureg::reconstruction {
namespace {

/// Pairs of one scan that are aligned with scans of other parts.
constexpr std::size_t kPairsOfScan = 24;
/// Scans at either side of a break that are aligned, by their number in the set.
constexpr std::uint32_t kBeside = 4;
/// Within a part poses are right, from scan to scan up to so many metres and radians.
constexpr double kOfPart = 0.999, kShiftOfPart = 0.005, kTurnOfPart = 0.002;
/// What consecutive numbers say for two parts: the log odds of a connection that no pair speaks of.
constexpr double kOfNumbers = 3;
/// Parts of fewer scans are aligned anew, scan by scan: a false loop leaves them bent.
constexpr std::size_t kLeastPart = 8;
/// Shift from which a scan has another pose, metres, and the same for the entries of its rotation.
constexpr double kMoved = 0.02;
/// Scans that may alone be wrong: so many, or this share.
constexpr double kFew = 2, kFewOfAll = 0.05;
/// Pairs are aligned at most so often.
constexpr int kMostPasses = 3;

using Parts = std::vector<std::uint32_t>;
constexpr std::uint32_t kNoPart = 0xffffffffu;

/// On which side of every contradicted connection each scan is.
std::vector<std::string> sides_of(std::size_t scans, const Audit& found) {
  std::vector<std::string> sides(scans);
  for (const AuditedConnection& connection : found.connections) {
    if (connection.verdict != ConnectionVerdict::contradicted) continue;
    for (std::string& side : sides) side.push_back('0');
    for (const std::uint32_t scan : found.scans_of(connection)) sides[scan].back() = '1';
  }
  return sides;
}

/// The pairs that contradict a connection that is contradicted. Others look wrong, too, in right
/// maps, and say nothing here.
std::vector<const AuditedPair*> contradictions_of(const Audit& found) {
  std::vector<const AuditedPair*> out;
  for (const AuditedConnection& connection : found.connections)
    if (connection.verdict == ConnectionVerdict::contradicted)
      for (const std::size_t k : connection.contradictions) out.push_back(&found.pairs[k]);
  return out;
}

/// What pairs between parts say of them.
class Affinities {
 public:
  explicit Affinities(std::size_t scans) : between_(scans), part_(scans) {
    std::iota(part_.begin(), part_.end(), 0u);
  }

  void add(std::uint32_t a, std::uint32_t b, double ratio) {
    a = part_of(a);
    b = part_of(b);
    if (a == b) return;
    between_[a][b] += ratio;
    between_[b][a] += ratio;
  }

  /// Merges parts, the most supported first, as long as more is said for it than against it: greedy
  /// additive edge contraction, Keuper et al. 2015.
  Parts merged() {
    std::set<std::tuple<double, std::uint32_t, std::uint32_t>> queue;
    for (std::uint32_t a = 0; a < between_.size(); ++a)
      for (const auto& [b, ratio] : between_[a])
        if (a < b && ratio > 0) queue.insert({-ratio, a, b});
    while (!queue.empty()) {
      const auto [minus_ratio, a, b] = *queue.begin();
      queue.erase(queue.begin());
      for (const auto& [c, ratio] : between_[b]) {
        if (ratio > 0) {
          const auto [low, high] = std::minmax(b, c);
          queue.erase({-ratio, low, high});
        }
        between_[c].erase(b);
        if (c == a) continue;
        double& sum = between_[a][c];
        const auto [low, high] = std::minmax(a, c);
        if (sum > 0) queue.erase({-sum, low, high});
        sum += ratio;
        between_[c][a] = sum;
        if (sum > 0) queue.insert({-sum, low, high});
      }
      between_[b].clear();
      part_[b] = a;
    }
    Parts out;
    for (std::uint32_t k = 0; k < part_.size(); ++k) out.push_back(part_of(k));
    return out;
  }

 private:
  std::uint32_t part_of(std::uint32_t k) {
    while (part_[k] != k) k = part_[k] = part_[part_[k]];
    return k;
  }

  std::vector<std::map<std::uint32_t, double>> between_;
  Parts part_;
};

/// Scans whose poses are right to each other as far as pairs say. Support across a contradicted
/// connection counts for nothing: what stands between the parts may look alike.
Parts parts_of(const std::vector<UnalignedIsometry3d>& poses, const Audit& found) {
  const auto scans = static_cast<std::uint32_t>(poses.size());
  const std::vector<std::string> sides = sides_of(scans, found);
  Affinities affinities(scans);
  const std::vector<const AuditedPair*> contradictions = contradictions_of(found);
  for (const AuditedPair* pair : contradictions)
    affinities.add(pair->source, pair->target, pair->log_likelihood_ratio);
  for (const AuditedPair& pair : found.pairs)
    if (pair.log_likelihood_ratio > 0 && sides[pair.source] == sides[pair.target])
      affinities.add(pair.source, pair.target, pair.log_likelihood_ratio);
  Parts out = affinities.merged();
  std::map<std::uint32_t, std::size_t> sizes;
  for (const std::uint32_t part : out) ++sizes[part];
  std::set<std::uint32_t> doubtful;
  for (const AuditedPair* pair : contradictions)
    doubtful.insert({out[pair->source], out[pair->target]});
  const auto stays = [&](std::uint32_t part) {
    return sizes[part] >= kLeastPart || doubtful.count(part) == 0;
  };
  std::set<std::pair<std::uint32_t, std::uint32_t>> heard;
  for (std::uint32_t k = 0, last = kNoPart; k < scans; ++k) {
    if (!poses[k].matrix().allFinite()) continue;
    if (last != kNoPart && sides[last] == sides[k] && stays(out[last]) && stays(out[k]) &&
        heard.insert(std::minmax(out[last], out[k])).second)
      affinities.add(last, k, kOfNumbers);
    last = k;
  }
  out = affinities.merged();
  doubtful.clear();
  for (const AuditedPair* pair : contradictions)
    doubtful.insert({out[pair->source], out[pair->target]});
  sizes.clear();
  for (const std::uint32_t part : out) ++sizes[part];
  for (std::uint32_t k = 0; k < scans; ++k)
    if (!poses[k].matrix().allFinite())
      out[k] = kNoPart;
    else if (sizes[out[k]] < kLeastPart && doubtful.count(out[k]) > 0)
      out[k] = k;
  return out;
}

/// Each scan of a part with the one before.
std::vector<Odometry> held(const std::vector<UnalignedIsometry3d>& poses, const Parts& parts) {
  std::map<std::uint32_t, std::uint32_t> last;
  std::vector<Odometry> out;
  for (std::uint32_t k = 0; k < parts.size(); ++k) {
    if (parts[k] == kNoPart) continue;
    const auto [at, first] = last.insert({parts[k], k});
    if (!first) {
      out.push_back(odometry_of(k, at->second, poses[at->second].inverse() * poses[k], kShiftOfPart,
                                kTurnOfPart));
      out.back().confidence = kOfPart;
    }
    at->second = k;
  }
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

/// Scans that take part in all contradictions, greedily: the one with the most of them first.
std::vector<std::uint32_t> blamed_scans(const Audit& found, std::size_t scans) {
  std::vector<const AuditedPair*> left = contradictions_of(found);
  std::vector<std::uint32_t> out;
  while (!left.empty()) {
    std::vector<double> blame(scans, 0);
    for (const AuditedPair* pair : left)
      for (const std::uint32_t scan : {pair->source, pair->target})
        blame[scan] -= pair->log_likelihood_ratio;
    const auto most =
        static_cast<std::uint32_t>(std::max_element(blame.begin(), blame.end()) - blame.begin());
    out.push_back(most);
    left.erase(std::remove_if(left.begin(), left.end(),
                              [&](const AuditedPair* pair) {
                                return pair->source == most || pair->target == most;
                              }),
               left.end());
  }
  return out;
}

/// Where the map is sound without a few scans, and hangs together as before, they alone are wrong:
/// each is a part of its own, and the others are one. Empty: it is not so.
Parts parts_without_few(const Context& context, const std::vector<PreparedCloud>& clouds,
                        const std::vector<UnalignedIsometry3d>& poses, const Audit& found,
                        const RegistrationOptions& registration, const AuditOptions& options) {
  const std::vector<std::uint32_t> few = blamed_scans(found, poses.size());
  if (static_cast<double>(few.size()) >
      std::max(kFew, kFewOfAll * static_cast<double>(found.order.size())))
    return {};
  std::vector<UnalignedIsometry3d> rest = poses;
  for (const std::uint32_t scan : few) rest[scan] = no_pose();
  const Audit left = audit(context, clouds, rest, registration, options);
  if (!left.sound() ||
      left.count(ConnectionVerdict::undecided) > found.count(ConnectionVerdict::undecided))
    return {};
  Parts out(poses.size(), kNoPart);
  for (std::uint32_t k = 0; k < poses.size(); ++k)
    if (poses[k].matrix().allFinite())
      out[k] = rest[k].matrix().allFinite() ? static_cast<std::uint32_t>(poses.size()) : k;
  return out;
}

/// Takes the map apart, and puts the parts together.
MendedMap put_together(const Context& context, const std::vector<PreparedCloud>& clouds,
                       const std::vector<UnalignedIsometry3d>& poses, const Audit& found,
                       const RegistrationOptions& registration, const AuditOptions& options) {
  MendedMap out;
  out.world_from_scan = poses;
  Parts parts = parts_without_few(context, clouds, poses, found, registration, options);
  if (parts.empty()) parts = parts_of(poses, found);
  const auto reconstruction = Options::from_voxel_size(registration.prepare.voxel_size);
  std::vector<Pair> pairs, more = pairs_to_align(parts, found);
  std::vector<RegistrationResult> results;
  std::vector<Odometry> odometry = held(poses, parts);
  // Few pairs see each other where the parts were; where they belong, more pairs hold them.
  for (int pass = 0; pass < kMostPasses && !more.empty(); ++pass) {
    std::vector<RegistrationResult> aligned = align_batch(context, clouds, more, registration);
    pairs.insert(pairs.end(), more.begin(), more.end());
    std::move(aligned.begin(), aligned.end(), std::back_inserter(results));
    AuditedReconstruction again = reconstruct_audited(
        context, clouds, pairs, results, reconstruction, odometry, registration, options);
    const std::vector<Odometry> joins =
        confirmed_joins(context, clouds, pairs, results, found.pairs, again.map, reconstruction,
                        registration, options);
    if (!joins.empty()) {
      odometry.insert(odometry.end(), joins.begin(), joins.end());
      again = reconstruct_audited(context, clouds, pairs, results, reconstruction, odometry,
                                  registration, options);
    }
    place(again.map, poses, out);
    more = pairs_between(clouds, parts, out.world_from_scan, pairs, kPairsOfScan);
  }
  out.registered = pairs.size();
  return out;
}

/// What an audit of the mended map contradicts has no pose any more.
void leave_out_contradicted(const Context& context, const std::vector<PreparedCloud>& clouds,
                            const RegistrationOptions& registration, const AuditOptions& options,
                            MendedMap& map) {
  for (;;) {
    map.audit = audit(context, clouds, map.world_from_scan, registration, options);
    if (map.audit.sound()) return;
    // The worst connection: others may be contradicted because of it.
    for (const std::uint32_t scan : map.audit.scans_of(map.audit.connections.front()))
      map.world_from_scan[scan] = no_pose();
  }
}

}  // namespace

MendedMap mend(const Context& context, const std::vector<PreparedCloud>& clouds,
               const std::vector<UnalignedIsometry3d>& world_from_scan, const Audit& found,
               const RegistrationOptions& registration, const AuditOptions& options) {
  if (world_from_scan.size() != clouds.size())
    throw InvalidArgument("world_from_scan has " + std::to_string(world_from_scan.size()) +
                          " entries, expected one per cloud, " + std::to_string(clouds.size()));
  MendedMap out;
  if (found.sound()) {
    out.world_from_scan = world_from_scan;
    out.audit = found;
    return out;
  }
  out = put_together(context, clouds, world_from_scan, found, registration, options);
  leave_out_contradicted(context, clouds, registration, options, out);
  list_changes(world_from_scan, out);
  return out;
}

}  // namespace gpureg::reconstruction
