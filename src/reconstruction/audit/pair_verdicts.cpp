// SPDX-License-Identifier: BSD-3-Clause
#include "reconstruction/audit/pair_verdicts.hpp"

#include <algorithm>
#include <cmath>

#include "reconstruction/audit/pair_model.hpp"

namespace gpureg::reconstruction {
namespace {

/// Share of the points in view from which free space says something.
constexpr double kLeastObserved = 0.04;
/// Overlap below which the pose is not worth an ICP.
constexpr double kLeastOverlap = 0.05;
/// A smaller logarithm of a likelihood ratio, less than two to one, says nothing.
constexpr double kSilent = 0.6;

/// Pairs that are verified in one batch: evidence and moments take up a kilobyte each.
constexpr std::size_t kMostAtOnce = 65536;

double overlap_of(const PoseEvidence& e) { return std::max(e.source_overlap, e.target_overlap); }

double shared(const PoseEvidence& e) {
  return std::max(e.source_overlap_any_normal, e.target_overlap_any_normal);
}

/// Of the side that is worse off in free space.
ImpliedPairEvidence evidence_of(const PoseVerification& pose) {
  const PoseEvidence& e = pose.evidence;
  ImpliedPairEvidence out;
  out.confidence = pose.confidence;
  out.shared = shared(e);
  for (const auto& [observed, share] :
       {std::pair(e.source_observed, e.source_free_space_violation),
        std::pair(e.target_observed, e.target_free_space_violation)})
    if (observed >= kLeastObserved && share > out.violation) {
      out.violation = share;
      out.violating = share * observed;
    }
  return out;
}

/// Where the pair belongs, and the points that overlap there.
void keep(const PoseVerification& pose, AuditedPair& out) {
  out.refined = pose.target_from_source;
  const CorrespondenceMoments& moments = pose.source_moments;
  if (moments.count == 0) return;
  const auto count = static_cast<double>(moments.count);
  out.overlap_centre = moments.sum / count;
  out.overlap_spread = moments.outer / count - out.overlap_centre * out.overlap_centre.transpose();
}

/// RMS distance between the poses of the overlap before and after.
double shift_of(const AuditedPair& pair) {
  const UnalignedIsometry3d &before = pair.target_from_source, &moved = pair.refined;
  const Eigen::Matrix3d turn = moved.linear() - before.linear();
  return std::sqrt((moved * pair.overlap_centre - before * pair.overlap_centre).squaredNorm() +
                   std::max(0.0, (turn * pair.overlap_spread * turn.transpose()).trace()));
}

double residual_of(const PoseEvidence& e) { return std::max(e.source_residual, e.target_residual); }

/// Whether the pose as it is gives no reason to ask ICP.
bool settled(const PoseVerification& given, double usual_residual) {
  const double ratio = log_likelihood_ratio(evidence_of(given));
  if (ratio < -kSilent) return false;
  return shared(given.evidence) < kLeastOverlap ||
         (ratio > kSilent && residual_of(given.evidence) < usual_residual);
}

/// Median of the residuals of the pairs whose surfaces coincide: where they do so better than
/// usual, ICP would find nothing.
double usual_residual_of(const std::vector<std::vector<PoseVerification>>& given) {
  std::vector<double> residuals;
  for (const std::vector<PoseVerification>& pose : given)
    if (log_likelihood_ratio(evidence_of(pose.front())) > kSilent)
      residuals.push_back(residual_of(pose.front().evidence));
  if (residuals.empty()) return 0;
  const auto middle = residuals.begin() + static_cast<std::ptrdiff_t>(residuals.size() / 2);
  std::nth_element(residuals.begin(), middle, residuals.end());
  return *middle;
}

/// judge_pairs() for those from `first` on.
void judge_some(const Context& context, const std::vector<PreparedCloud>& clouds,
                const RegistrationOptions& registration, const AuditOptions& options,
                std::size_t first, std::size_t count, std::vector<AuditedPair>& pairs) {
  std::vector<Pair> all, doubtful;
  std::vector<std::vector<UnalignedIsometry3d>> poses, doubtful_poses;
  for (std::size_t k = first; k < first + count; ++k) {
    all.push_back({pairs[k].source, pairs[k].target});
    poses.push_back({pairs[k].target_from_source});
  }
  VerificationOptions verification;
  verification.search_alternatives = false;
  const auto given = verify_poses_batch(context, clouds, all, poses, registration, verification);
  const double usual = usual_residual_of(given);
  std::vector<std::size_t> place(count, count);
  for (std::size_t k = 0; k < count; ++k) {
    if (settled(given[k].front(), usual)) continue;
    place[k] = doubtful.size();
    doubtful.push_back(all[k]);
    doubtful_poses.push_back(poses[k]);
  }
  verification.refine = true;
  const auto refined =
      verify_poses_batch(context, clouds, doubtful, doubtful_poses, registration, verification);
  for (std::size_t k = 0; k < count; ++k) {
    AuditedPair& pair = pairs[first + k];
    const double margin = options.max_shift + options.max_shift_per_metre *
                                                  pair.target_from_source.translation().norm();
    judge_pair(given[k].front(), place[k] < doubtful.size() ? &refined[place[k]].front() : nullptr,
               margin, pair);
  }
}

}  // namespace

AuditedPair pair_at(const Pair& pair, const std::vector<UnalignedIsometry3d>& world_from_scan) {
  AuditedPair out;
  out.source = pair.source;
  out.target = pair.target;
  out.target_from_source = world_from_scan[pair.target].inverse() * world_from_scan[pair.source];
  return out;
}

void judge_pair(const PoseVerification& given, const PoseVerification* refined, double margin,
                AuditedPair& out) {
  out.overlap = overlap_of(given.evidence);
  out.observed = std::max(given.evidence.source_observed, given.evidence.target_observed);
  ImpliedPairEvidence evidence = evidence_of(given);
  double rival = 0;
  keep(refined != nullptr ? *refined : given, out);
  if (refined != nullptr) {
    out.shift = shift_of(out);
    const ImpliedPairEvidence after = evidence_of(*refined);
    if (out.shift > margin) {
      rival = log_likelihood_ratio(after);
    } else {
      // What goes away within the margin of the map is no contradiction.
      evidence.confidence = std::max(evidence.confidence, after.confidence);
      if (after.violation < evidence.violation) {
        evidence.violation = after.violation;
        evidence.violating = after.violating;
      }
    }
  }
  out.violation = evidence.violation;
  double ratio = log_likelihood_ratio(evidence);
  // Of two places that are further apart than the map may be off, at most one is right.
  if (rival > kSilent) ratio -= rival;
  if (std::abs(ratio) < kSilent) return;
  out.log_likelihood_ratio = ratio;
  out.verdict = ratio > 0 ? PairVerdict::supports : PairVerdict::contradicts;
}

void judge_pairs(const Context& context, const std::vector<PreparedCloud>& clouds,
                 const RegistrationOptions& registration, const AuditOptions& options,
                 std::vector<AuditedPair>& pairs) {
  for (std::size_t first = 0; first < pairs.size(); first += kMostAtOnce)
    judge_some(context, clouds, registration, options, first,
               std::min(kMostAtOnce, pairs.size() - first), pairs);
}

}  // namespace gpureg::reconstruction
