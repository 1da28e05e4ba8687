// SPDX-License-Identifier: BSD-3-Clause
#include "reconstruction/audit/companions.hpp"

#include <algorithm>
#include <cmath>
#include <map>

#include "math/exponential.hpp"
#include "reconstruction/audit/pair_verdicts.hpp"

namespace gpureg::reconstruction {
namespace {

/// Pairs from this confidence are asked, and ask.
constexpr double kLeastConfidence = 0.1;
/// Companions of a pair at each of its scans.
constexpr std::size_t kCompanions = 4;
/// Rounds of updates, and the share of the change that each makes.
constexpr int kRounds = 8;
constexpr double kDamping = 0.5;
/// A pair that looks right says less than one that contradicts: at equal furniture half of the
/// wrong ones look right.
constexpr double kOfAgreement = 0.2;
constexpr double kLeastOdds = 1e-4;

/// A pair of the set whose first mode takes part.
struct Member {
  std::size_t pair = 0;
  std::uint32_t source = 0, target = 0;
  UnalignedIsometry3d target_from_source;
  double prior = 0;  ///< log odds
  double overlap = 0;

  std::uint32_t other(std::uint32_t scan) const { return scan == source ? target : source; }
  /// Pose of the other scan in the frame of this one.
  UnalignedIsometry3d from_other(std::uint32_t scan) const {
    return scan == target ? target_from_source : UnalignedIsometry3d(target_from_source.inverse());
  }
};

/// Two members that share a scan, and what the two other scans say.
struct Triplet {
  std::size_t first = 0, second = 0;
  double log_likelihood_ratio = 0;
};

double log_odds(double confidence) {
  const double p = std::clamp(confidence, kLeastOdds, 1 - kLeastOdds);
  return portable::log(p / (1 - p));
}
double confidence_of(double odds) { return portable::logistic(odds); }

std::vector<Member> members_of(std::size_t scans, const std::vector<Pair>& pairs,
                               const std::vector<RegistrationResult>& results) {
  std::vector<Member> out;
  for (std::size_t k = 0; k < std::min(pairs.size(), results.size()); ++k) {
    if (!results[k].has_pose() || results[k].modes.empty() ||
        std::max(pairs[k].source, pairs[k].target) >= scans)
      continue;
    const RegistrationMode& mode = results[k].modes.front();
    if (mode.confidence < kLeastConfidence) continue;
    Member member;
    member.pair = k;
    member.source = pairs[k].source;
    member.target = pairs[k].target;
    member.target_from_source = mode.target_from_source;
    member.prior = log_odds(mode.confidence);
    member.overlap = std::max(mode.evidence.source_overlap, mode.evidence.target_overlap);
    out.push_back(member);
  }
  return out;
}

/// Each member with the best companions at each of its scans: they overlap most and look right.
std::vector<Triplet> triplets_of(std::size_t scans, const std::vector<Member>& members) {
  std::vector<std::vector<std::size_t>> at(scans);
  for (std::size_t k = 0; k < members.size(); ++k)
    for (const std::uint32_t scan : {members[k].source, members[k].target}) at[scan].push_back(k);
  const auto weight = [&](std::size_t k) {
    return confidence_of(members[k].prior) * (0.1 + members[k].overlap);
  };
  for (std::vector<std::size_t>& list : at)
    std::stable_sort(list.begin(), list.end(),
                     [&](std::size_t a, std::size_t b) { return weight(a) > weight(b); });
  std::map<std::pair<std::size_t, std::size_t>, Triplet> chosen;
  for (std::size_t k = 0; k < members.size(); ++k)
    for (const std::uint32_t scan : {members[k].source, members[k].target}) {
      std::size_t taken = 0;
      for (const std::size_t other : at[scan]) {
        if (taken == kCompanions) break;
        if (other == k || members[other].other(scan) == members[k].other(scan)) continue;
        ++taken;
        const auto [low, high] = std::minmax(k, other);
        chosen[{low, high}] = {low, high, 0};
      }
    }
  std::vector<Triplet> out;
  for (const auto& entry : chosen) out.push_back(entry.second);
  return out;
}

/// The pose that two members imply for their two other scans.
AuditedPair implied(const Member& first, const Member& second) {
  const std::uint32_t shared =
      first.source == second.source || first.source == second.target ? first.source : first.target;
  AuditedPair pair;
  pair.source = first.other(shared);
  pair.target = second.other(shared);
  pair.target_from_source = second.from_other(shared).inverse() * first.from_other(shared);
  return pair;
}

/// Whether a registered pair has the pose that two others imply, up to the margin of a good map.
bool agrees(const Member& member, const AuditedPair& pair, const AuditOptions& options) {
  const UnalignedIsometry3d source_from_target = member.from_other(pair.source);
  const UnalignedIsometry3d difference = pair.target_from_source * source_from_target;
  constexpr double kSameEntry = 0.1;  // of an entry of the matrix: some six degrees
  return difference.translation().norm() <= options.max_shift &&
         (difference.linear() - Eigen::Matrix3d::Identity()).cwiseAbs().maxCoeff() < kSameEntry;
}

/// What a triplet says about one of its members, in view of the odds of the other.
double message(double log_likelihood_ratio, double odds_of_other) {
  const double right = confidence_of(odds_of_other);
  const double ratio =
      portable::exp(log_likelihood_ratio > 0 ? std::min(log_likelihood_ratio, kOfAgreement)
                                             : log_likelihood_ratio);
  return portable::log(right * ratio + 1 - right);
}

}  // namespace

void hear_companions(const Context& context, const std::vector<PreparedCloud>& clouds,
                     const std::vector<Pair>& pairs, const RegistrationOptions& registration,
                     const AuditOptions& options, std::vector<RegistrationResult>& results) {
  const std::vector<Member> members = members_of(clouds.size(), pairs, results);
  std::vector<Triplet> triplets = triplets_of(clouds.size(), members);
  // A registered pair of the two other scans that agrees has been verified already.
  std::map<std::pair<std::uint32_t, std::uint32_t>, std::size_t> known;
  for (std::size_t k = 0; k < members.size(); ++k)
    known[std::minmax(members[k].source, members[k].target)] = k;
  std::vector<AuditedPair> asked;
  std::vector<std::size_t> asked_for;
  for (std::size_t k = 0; k < triplets.size(); ++k) {
    const AuditedPair pair = implied(members[triplets[k].first], members[triplets[k].second]);
    const auto third = known.find(std::minmax(pair.source, pair.target));
    if (third != known.end() && agrees(members[third->second], pair, options)) {
      triplets[k].log_likelihood_ratio = kOfAgreement;
      continue;
    }
    asked.push_back(pair);
    asked_for.push_back(k);
  }
  judge_pairs(context, clouds, registration, options, asked);
  for (std::size_t k = 0; k < asked.size(); ++k)
    triplets[asked_for[k]].log_likelihood_ratio = asked[k].log_likelihood_ratio;

  std::vector<double> odds;
  for (const Member& member : members) odds.push_back(member.prior);
  for (int round = 0; round < kRounds; ++round) {
    std::vector<double> heard;
    for (const Member& member : members) heard.push_back(member.prior);
    for (const Triplet& triplet : triplets) {
      heard[triplet.first] += message(triplet.log_likelihood_ratio, odds[triplet.second]);
      heard[triplet.second] += message(triplet.log_likelihood_ratio, odds[triplet.first]);
    }
    for (std::size_t k = 0; k < odds.size(); ++k) odds[k] += kDamping * (heard[k] - odds[k]);
  }
  for (std::size_t k = 0; k < members.size(); ++k) {
    // Support makes no pair more certain than its own evidence.
    RegistrationMode& mode = results[members[k].pair].modes.front();
    mode.confidence = std::min(mode.confidence, confidence_of(odds[k]));
  }
}

}  // namespace gpureg::reconstruction
