// SPDX-License-Identifier: BSD-3-Clause
#include "localization/find/instances.hpp"

#include <algorithm>

#include "common/for_each_on.hpp"
#include "localization/find/part_confidence.hpp"

namespace gpureg::localization {
namespace {

/// Two poses of which one shares this much of its surface in the scene are of one instance.
constexpr double kShared = 0.3;
/// RMS distance, over the diameter, within which a pose is no rival, and within which a symmetry
/// explains one.
constexpr double kSame = 0.1;
/// Poses farther apart than so many times a distance, at their origins, are not closer than it.
constexpr double kFar = 20;

/// Of the smaller one.
double shared(const std::vector<std::uint32_t>& a, const std::vector<std::uint32_t>& b) {
  std::size_t both = 0;
  for (std::size_t i = 0, j = 0; i < a.size() && j < b.size();) {
    both += a[i] == b[j];
    const bool first = a[i] <= b[j], second = b[j] <= a[i];
    i += first;
    j += second;
  }
  const std::size_t least = std::min(a.size(), b.size());
  return least == 0 ? 0 : static_cast<double>(both) / static_cast<double>(least);
}

/// Support less violation, by area: what compares poses of one surface.
double merit(const PartEvidence& e) { return std::max(0.0, (e.supported - e.violated) * e.area); }

}  // namespace

void judge(const PartVerifier& verifier, unsigned threads, std::vector<Hypothesis>& all) {
  for_each_on(threads, all.size(), [&](std::size_t k) {
    Hypothesis& h = all[k];
    h.verdict = verifier.verify(h.pose);
    h.verdict.evidence.votes = h.votes;
    h.log_odds = part_log_odds(h.verdict.evidence);
  });
  std::stable_sort(all.begin(), all.end(), [](const Hypothesis& a, const Hypothesis& b) {
    return a.log_odds > b.log_odds;
  });
}

std::vector<Hypothesis> distinct(const PartVerifier& verifier, std::vector<Hypothesis> all,
                                 double distance) {
  std::vector<Hypothesis> out;
  for (Hypothesis& h : all) {
    const auto same = std::find_if(out.begin(), out.end(), [&](const Hypothesis& kept) {
      return (kept.pose.translation() - h.pose.translation()).norm() < kFar * distance &&
             verifier.displacement(kept.pose, h.pose) < distance;
    });
    if (same == out.end())
      out.push_back(std::move(h));
    else
      same->votes += h.votes;
  }
  return out;
}

std::vector<Hypothesis> instances_of(const PartVerifier& verifier, CloudSymmetry& symmetry,
                                     double diameter, std::vector<Hypothesis> all) {
  std::vector<Hypothesis> out;
  for (Hypothesis& h : all) {
    if (h.verdict.claimed.empty()) continue;
    Hypothesis* owner = nullptr;
    double most = kShared;
    for (Hypothesis& kept : out) {
      const double share = shared(kept.verdict.claimed, h.verdict.claimed);
      if (share < most) continue;
      most = share;
      owner = &kept;
    }
    if (owner == nullptr) {
      out.push_back(std::move(h));
      continue;
    }
    if (verifier.displacement(owner->pose, h.pose) < kSame * diameter) continue;
    if (symmetry.has(owner->pose.inverse() * h.pose, kSame * diameter)) {
      ++owner->equivalent;
      continue;
    }
    PartEvidence& best = owner->verdict.evidence;
    if (const double own = merit(best); own > 0)
      best.rival = std::max(best.rival, merit(h.verdict.evidence) / own);
  }
  return out;
}

}  // namespace gpureg::localization
