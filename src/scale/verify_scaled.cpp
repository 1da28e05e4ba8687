// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <cmath>
#include <memory>
#include <utility>

#include "api/access.hpp"
#include "api/name_cloud.hpp"
#include "api/with_settings.hpp"
#include "common/for_each_on.hpp"
#include "common/rigid.hpp"
#include "common/stop_scope.hpp"
#include "common/validate.hpp"
#include "gpureg/registration/scale.hpp"
#include "scale/ladder.hpp"
#include "scale/limits.hpp"
#include "scale/prepared_surface.hpp"

namespace gpureg {
namespace {

/// A similarity under verification.
struct Proposal {
  double scale = 1;
  UnalignedIsometry3d rigid = UnalignedIsometry3d::Identity();  ///< of the scaled source
  ScaledVerification found;
  double next = 1;  ///< the scale that refinement asks for
  bool settled = false;
};

/// The scale is that of all columns together.
Proposal proposal_of(const UnalignedMatrix4d& given, const std::string& name) {
  Proposal out;
  out.scale = std::sqrt(given.topLeftCorner<3, 3>().squaredNorm() / 3);
  out.rigid.matrix() = given;
  if (out.scale > 0) out.rigid.linear() /= out.scale;
  const std::string why = why_not_rigid(out.rigid.matrix());
  if (why.empty()) return out;
  throw InvalidArgument(name + " is no rotation times a scale with a translation: divided by " +
                        shown(out.scale, 6) + ", " + why);
}

/// Verifies proposals at their scales; equal scales share a preparation.
void verify_at(const Context& context, const PointCloudView& source,
               const scale::PreparedSurface& target, const RegistrationSettings& options,
               const VerificationOptions& verification, const std::vector<Proposal*>& proposals) {
  std::vector<double> scales;
  for (const Proposal* p : proposals) scales.push_back(p->scale);
  std::sort(scales.begin(), scales.end());
  scales.erase(std::unique(scales.begin(), scales.end()), scales.end());
  std::vector<std::unique_ptr<scale::ScaledCloud>> copies;
  std::vector<PointCloudView> views;
  for (const double s : scales) {
    copies.push_back(std::make_unique<scale::ScaledCloud>(source, s));
    views.push_back(copies.back()->view());
  }
  std::vector<PreparedCloud> clouds = naming_cloud(
      {"source", "target"}, 2, 0, [&] { return prepare_batch(context, views, options.prepare); });
  std::vector<Pair> pairs;
  std::vector<std::vector<UnalignedIsometry3d>> poses(scales.size());
  std::vector<std::pair<std::size_t, std::size_t>> places;
  for (std::uint32_t k = 0; k < scales.size(); ++k)
    pairs.push_back({k, static_cast<std::uint32_t>(scales.size())});
  for (const Proposal* p : proposals) {
    const auto k = static_cast<std::size_t>(
        std::lower_bound(scales.begin(), scales.end(), p->scale) - scales.begin());
    places.emplace_back(k, poses[k].size());
    poses[k].push_back(p->rigid);
  }
  clouds.push_back(target.cloud());
  const auto verified = verify_poses_batch(context, clouds, pairs, poses, options, verification);
  for_each_on(Access::engine(context)->host_threads(), proposals.size(), [&](std::size_t k) {
    Proposal& p = *proposals[k];
    ScaledVerification& out = p.found;
    out.verification = verified[places[k].first][places[k].second];
    out.scale = p.next = p.scale;
    const scale::PreparedSurface surface(
        clouds[places[k].first],
        scale::kReachOfSource * options.prepare.max_correspondence_distance);
    const scale::RefinedScale refined = scale::refine_scale(
        surface, target, out.verification.target_from_source, options.refine.kernel_width);
    out.information = refined.information;
    out.scale_deviation =
        refined.scale_information > 0 ? refined.rms / std::sqrt(refined.scale_information) : 0;
    if (refined.points == 0)
      out.scale_status = ScaleStatus::none;
    else if (refined.stiffness < scale::kLeastStiffness)
      out.scale_status = ScaleStatus::not_observable;
    else
      out.scale_status = verification.refine ? ScaleStatus::found : ScaleStatus::known;
    if (out.scale_status == ScaleStatus::found &&
        std::abs(refined.factor - 1) <= scale::kMostChange)
      p.next = p.scale * refined.factor;
  });
}

/// Moves a proposal to its next scale; the centre of the points in common stays where it is.
void move_to_next_scale(Proposal& p) {
  const PoseVerification& at = p.found.verification;
  p.rigid = at.target_from_source;
  if (at.source_moments.count > 0) {
    const Eigen::Vector3d centre =
        at.source_moments.sum / static_cast<double>(at.source_moments.count);
    p.rigid.translation() += p.rigid.linear() * (centre * (1 - p.next / p.scale));
  }
  p.scale = p.next;
}

/// A scale excludes the others that were proposed: it gets no more than its share of the odds.
void share_odds_of_scales(std::vector<Proposal>& proposals) {
  std::vector<double> before;
  for (const Proposal& p : proposals) before.push_back(p.found.verification.confidence);
  for (std::size_t k = 0; k < proposals.size(); ++k) {
    double rival = 0;
    for (std::size_t other = 0; other < proposals.size(); ++other)
      if (std::abs(proposals[other].found.scale / proposals[k].found.scale - 1) >=
          scale::kSameScale)
        rival = std::max(rival, scale::odds_of(before[other]));
    const double own = scale::odds_of(before[k]);
    if (!(rival > 0) || !(own > 0)) continue;
    PoseVerification& out = proposals[k].found.verification;
    const double after = std::min(before[k], own / (own + rival));
    out.overlap_confidence *= after / before[k];
    out.confidence = after;
  }
}

}  // namespace

Eigen::Matrix4d ScaledVerification::similarity() const {
  Eigen::Matrix4d out = verification.target_from_source.matrix();
  out.topLeftCorner<3, 3>() *= scale;
  return out;
}

std::vector<ScaledVerification> verify_scaled_poses(
    const Context& context, const PointCloudView& source, const PointCloudView& target,
    const std::vector<UnalignedMatrix4d>& similarities, const RegistrationOptions& given,
    const VerificationOptions& verification) {
  const RegistrationSettings options = resolve(given);
  require(options.prepare.voxel_size > 0, "prepare.downsample", "false",
          "true where clouds have scales");
  std::vector<Proposal> proposals;
  for (std::size_t k = 0; k < similarities.size(); ++k)
    proposals.push_back(proposal_of(similarities[k], "similarities[" + std::to_string(k) + "]"));
  const std::vector<std::string> names{"source", "target"};
  const scale::PreparedSurface fixed(
      naming_cloud(names, 2, 1, [&] { return prepare(context, target, options.prepare); }),
      scale::kReach * options.prepare.max_correspondence_distance);
  naming_cloud(names, 2, 0, [&] { source.validate(); });

  for (int round = 0; round < scale::kRounds; ++round) {
    std::vector<Proposal*> open;
    for (Proposal& p : proposals)
      if (!p.settled) open.push_back(&p);
    if (open.empty()) break;
    verify_at(context, source, fixed, options, verification, open);
    for (Proposal* p : open) {
      p->settled = std::abs(p->next / p->scale - 1) < scale::kSettled;
      if (!p->settled) move_to_next_scale(*p);
    }
  }
  share_odds_of_scales(proposals);
  std::vector<ScaledVerification> out;
  for (Proposal& p : proposals) out.push_back(std::move(p.found));
  return out;
}

}  // namespace gpureg
