// SPDX-License-Identifier: BSD-3-Clause
#include "reconstruction/audit/parts.hpp"

#include <algorithm>
#include <map>
#include <numeric>
#include <set>
#include <string>
#include <tuple>

#include "reconstruction/audit/in_units.hpp"

namespace gpureg::reconstruction {
namespace {

/// What consecutive numbers say for two parts: the log odds of a connection that no pair speaks of.
constexpr double kOfNumbers = 3;
/// Parts of fewer scans are aligned anew, scan by scan: a false loop leaves them bent.
constexpr std::size_t kLeastPart = 8;
/// Scans that may alone be wrong: so many, or this share.
constexpr double kFew = 2, kFewOfAll = 0.05;

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

}  // namespace

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

Parts parts_without_few(const Context& context, const std::vector<PreparedCloud>& clouds,
                        const std::vector<UnalignedIsometry3d>& poses, const Audit& found,
                        const RegistrationOptions& registration, const AuditOptions& options) {
  const std::vector<std::uint32_t> few = blamed_scans(found, poses.size());
  if (static_cast<double>(few.size()) >
      std::max(kFew, kFewOfAll * static_cast<double>(found.order.size())))
    return {};
  std::vector<UnalignedIsometry3d> rest = poses;
  for (const std::uint32_t scan : few) rest[scan] = no_pose();
  const Audit left = audit_in_units(context, clouds, map_of_poses(rest), registration, options);
  if (left.verdict() == AuditVerdict::contradicted ||
      left.count(ConnectionVerdict::undecided) > found.count(ConnectionVerdict::undecided))
    return {};
  Parts out(poses.size(), kNoPart);
  for (std::uint32_t k = 0; k < poses.size(); ++k)
    if (poses[k].matrix().allFinite())
      out[k] = rest[k].matrix().allFinite() ? static_cast<std::uint32_t>(poses.size()) : k;
  return out;
}

}  // namespace gpureg::reconstruction
