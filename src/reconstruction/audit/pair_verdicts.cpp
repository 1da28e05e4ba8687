// SPDX-License-Identifier: BSD-3-Clause
#include "reconstruction/audit/pair_verdicts.hpp"

#include <algorithm>
#include <cmath>

namespace gpureg::reconstruction {
namespace {

/// Share of the points in view from which free space says something.
constexpr double kLeastObserved = 0.04;
/// Of the points in view: noise and thin surfaces put some into free space at right poses, too.
/// Of the pairs that coincide at right poses, in rooms and of LiDAR, 95 of 100 have less than
/// kNoViolation and 98 less than kSlightViolation; scans of a street that are metres off often have
/// no more than a bent corner of a room.
constexpr double kNoViolation = 0.02, kSlightViolation = 0.03, kViolation = 0.1,
                 kStrongViolation = 0.3;
/// Points in free space, at least so many.
constexpr double kLeastPoints = 40;
/// Of all points: one bent corner of a scan contradicts many others with less. In ten right maps
/// six of 6,809 pairs had more, at aliases a fifth.
constexpr double kCorner = 0.03, kOfCorner = 0.5;
/// Confidence of a pose whose surfaces coincide, and of one whose surfaces do not.
constexpr double kSupports = 0.9, kDoubts = 0.3;
/// Share of one scan that lies at the other's surfaces, whatever the normals, from which surfaces
/// that do not coincide contradict the pose. With less, right poses have low confidences, too.
constexpr double kLeastShared = 0.25;
/// Where nothing holds the scans along a wall or a floor, surfaces that coincide have low
/// confidences at right poses, too: the smallest eigenvalue of the information as a share of the
/// largest; and of the points at the other's surfaces, so many have other normals where they do not
/// coincide.
constexpr double kHeld = 1e-3, kOtherNormals = 0.2;
/// Overlap below which the pose is not worth an ICP.
constexpr double kLeastOverlap = 0.05;
/// A pose from which ICP moves the scans further than the map may be off is wrong where their
/// surfaces then coincide so much better: along a corridor they do not.
constexpr double kBetterResidual = 0.9, kBetterOverlap = 1.1;
/// Logarithms of likelihood ratios. In good maps 95 of 100 pairs reach kSupports, and 1 to 2 of 100
/// violate free space; 0.3 metres off, none of 100 and a third. Equal furniture makes wrong poses
/// look right, too.
constexpr double kOfSupport = 0.7, kOfSlightViolation = -1, kOfViolation = -2,
                 kOfStrongViolation = -3.5, kOfDoubt = -2.5, kOfShift = -2;

/// Pairs that are verified in one batch: evidence and moments take up a kilobyte each.
constexpr std::size_t kMostAtOnce = 65536;

/// The worse side of the evidence.
struct Violation {
  double share = 0, points = 0;
};

Violation violation_of(const PoseVerification& pose, std::size_t points) {
  const PoseEvidence& e = pose.evidence;
  Violation worst;
  for (const auto& [observed, share] :
       {std::pair(e.source_observed, e.source_free_space_violation),
        std::pair(e.target_observed, e.target_free_space_violation)})
    if (observed >= kLeastObserved && share > worst.share)
      worst = {share, share * observed * static_cast<double>(points)};
  return worst;
}

bool violates(const Violation& violation, double least = kViolation) {
  return violation.share > least && violation.points >= kLeastPoints;
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

double overlap_of(const PoseEvidence& e) { return std::max(e.source_overlap, e.target_overlap); }

double residual_of(const PoseEvidence& e) { return std::max(e.source_residual, e.target_residual); }

/// Whether the surfaces coincide much better at the second pose.
bool fits_better(const PoseEvidence& before, const PoseEvidence& after) {
  const double residual = std::min(before.source_residual, before.target_residual);
  return residual_of(after) < kBetterResidual * residual ||
         overlap_of(after) > kBetterOverlap * overlap_of(before);
}

double shared(const PoseEvidence& e) {
  return std::max(e.source_overlap_any_normal, e.target_overlap_any_normal);
}

bool is_held(const PoseEvidence& e) {
  return e.information_eigenvalues[0] > kHeld * e.information_eigenvalues[5];
}

/// Whether the pose as it is gives no reason to ask ICP.
bool settled(const PoseVerification& given, std::size_t points, double usual_residual) {
  if (violates(violation_of(given, points), kSlightViolation)) return false;
  return shared(given.evidence) < kLeastOverlap ||
         (given.confidence >= kSupports && residual_of(given.evidence) < usual_residual);
}

/// Median of the residuals of the pairs whose surfaces coincide: where they do so better than
/// usual, ICP would find nothing.
double usual_residual_of(const std::vector<std::vector<PoseVerification>>& given) {
  std::vector<double> residuals;
  for (const std::vector<PoseVerification>& pose : given)
    if (pose.front().confidence >= kSupports)
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
  const auto points = [&](const Pair& pair) {
    return std::min(clouds[pair.source].size(), clouds[pair.target].size());
  };
  VerificationOptions verification;
  verification.search_alternatives = false;
  const auto given = verify_poses_batch(context, clouds, all, poses, registration, verification);
  const double usual = usual_residual_of(given);
  std::vector<std::size_t> place(count, count);
  for (std::size_t k = 0; k < count; ++k) {
    if (settled(given[k].front(), points(all[k]), usual)) continue;
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
               points(all[k]), margin, pair);
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

void judge_pair(const PoseVerification& given, const PoseVerification* refined, std::size_t points,
                double margin, AuditedPair& out) {
  out.overlap = overlap_of(given.evidence);
  out.observed = std::max(given.evidence.source_observed, given.evidence.target_observed);
  Violation violation = violation_of(given, points);
  double confidence = given.confidence;
  bool elsewhere = false, moved = false, stays = true;
  keep(refined != nullptr ? *refined : given, out);
  if (refined != nullptr) {
    out.shift = shift_of(out);
    const Violation left = violation_of(*refined, points);
    stays = out.shift <= margin;
    if (stays) {
      // What goes away within the margin of the map is no contradiction.
      if (left.share < violation.share) violation = left;
      confidence = std::max(confidence, refined->confidence);
    } else {
      elsewhere = refined->confidence >= kSupports && !violates(left);
      moved = elsewhere && fits_better(given.evidence, refined->evidence);
    }
  }
  out.violation = violation.share;
  double& ratio = out.log_likelihood_ratio;
  if (violates(violation)) {
    ratio = violation.share > kStrongViolation ? kOfStrongViolation : kOfViolation;
    if (violation.points < kCorner * static_cast<double>(points)) ratio *= kOfCorner;
  } else if (confidence < kDoubts && shared(given.evidence) >= kLeastShared &&
             (is_held(given.evidence) ||
              out.overlap < (1 - kOtherNormals) * shared(given.evidence)))
    ratio = kOfDoubt;
  else if (moved || (confidence < kDoubts && elsewhere))
    ratio = kOfShift;
  else if (violates(violation, kSlightViolation))
    ratio = kOfSlightViolation;
  else if (confidence >= kSupports && stays && violation.share <= kNoViolation)
    ratio = kOfSupport;
  if (ratio > 0) out.verdict = PairVerdict::supports;
  if (ratio < 0) out.verdict = PairVerdict::contradicts;
}

void judge_pairs(const Context& context, const std::vector<PreparedCloud>& clouds,
                 const RegistrationOptions& registration, const AuditOptions& options,
                 std::vector<AuditedPair>& pairs) {
  for (std::size_t first = 0; first < pairs.size(); first += kMostAtOnce)
    judge_some(context, clouds, registration, options, first,
               std::min(kMostAtOnce, pairs.size() - first), pairs);
}

}  // namespace gpureg::reconstruction
