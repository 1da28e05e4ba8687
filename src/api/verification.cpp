// SPDX-License-Identifier: BSD-3-Clause
#include "gpureg/verification.hpp"

#include <algorithm>
#include <string>

#include "api/engine_calls.hpp"
#include "api/outcome.hpp"
#include "api/pair_input.hpp"
#include "api/verify_by_surfaces.hpp"
#include "api/with_settings.hpp"
#include "common/for_each_on.hpp"
#include "common/rigid.hpp"
#include "common/stop_scope.hpp"
#include "confidence/calibrate_modes.hpp"

namespace gpureg {
namespace {

/// One pair whose poses are verified.
struct VerifiedPair : AlignedPair {
  PoseVerification verification_of(const ModeOutcome& mode, const PoseEvidence& evidence) const {
    PoseVerification out;
    out.target_from_source = transform_of(mode.pose);
    out.evidence = evidence;
    out.inliers = mode.source.points(Term::inliers);
    out.points = mode.source.points(Term::tested);
    out.inlier_ratio = out.points > 0 ? static_cast<double>(out.inliers) / out.points : 0.0;
    out.inlier_rmse = rmse(mode.source);
    out.source_moments = source_moments(mode);
    out.target_moments = target_moments(mode);
    return out;
  }

  /// A pose that competes.
  struct Candidate {
    UnalignedIsometry3d target_from_source;
    PoseEvidence evidence;
    confidence::OverlapCount overlap;  ///< counts for the verified pose alone
  };

  /// The distinct poses that align() finds for the pair.
  std::vector<Candidate> alternatives_of(const PairOutcome& found) const {
    std::vector<Candidate> out;
    for (const RegistrationMode& mode : to_row_result(found, *this).modes)
      out.push_back({mode.target_from_source, mode.evidence, {0, 0}});
    return out;
  }

  /// Confidence of a pose against the alternatives that are not the same mode.
  confidence::ModeConfidence confidence_of(const Candidate& pose,
                                           const std::vector<Candidate>& alternatives,
                                           const CorrespondenceMoments& points) const {
    const Eigen::Vector3d middle = middle_of(points, origin_of(source));
    const double distance =
        kDistinctModeFraction * static_cast<double>(options.evidence.mode_distance);
    std::vector<Candidate> all{pose};
    for (const Candidate& other : alternatives)
      if (!same_mode_at(pose.target_from_source, other.target_from_source, middle,
                        options.evidence) ||
          distance_between(pose.target_from_source, other.target_from_source, points) > distance)
        all.push_back(other);
    std::vector<PoseEvidence> evidence;
    for (const Candidate& c : all) evidence.push_back(c.evidence);
    const confidence::Ranking ranking = ranking_of(evidence);
    std::vector<confidence::RankedMode> ranked;
    for (const std::size_t k : ranking.order)
      ranked.push_back({all[k].evidence, ranking.log_odds[k], all[k].overlap});
    std::vector<confidence::ModeConfidence> confidences =
        confidence::confidences_of(ranked, ranking.available, options.evidence.modes);
    confidence::calibrate_modes(options.calibration, std::vector<bool>(ranked.size()), confidences);
    const auto place = std::find(ranking.order.begin(), ranking.order.end(), std::size_t(0));
    return confidences[static_cast<std::size_t>(place - ranking.order.begin())];
  }
};

/// Sides of clouds are the same for all poses of a pair: keeps the variant whose most confident
/// pose is the more confident, the first one of equals.
void keep_more_confident(std::vector<PoseVerification>&& candidate,
                         std::vector<PoseVerification>& kept) {
  const auto most = [](const std::vector<PoseVerification>& poses) {
    double confidence = -1;
    for (const PoseVerification& pose : poses) confidence = std::max(confidence, pose.confidence);
    return confidence;
  };
  if (most(candidate) > most(kept)) kept = std::move(candidate);
}

/// The poses of one pair with their evidence, between the rows of the clouds.
std::vector<PoseVerification> measured(const VerifiedPair& pair, const PairOutcome& outcome) {
  std::vector<PoseVerification> out;
  const std::vector<PoseEvidence> evidence = pair.evidence_of(outcome);
  for (std::size_t k = 0; k < outcome.modes.size(); ++k)
    out.push_back(pair.verification_of(outcome.modes[k], evidence[k]));
  return out;
}

/// Sets the confidences of the poses of one pair; found: what align() finds for it, if that counts.
void set_confidences(const VerifiedPair& pair, const PairOutcome& outcome, const PairOutcome* found,
                     std::vector<PoseVerification>& poses) {
  std::vector<VerifiedPair::Candidate> given;
  for (std::size_t k = 0; k < poses.size(); ++k)
    given.push_back({poses[k].target_from_source, poses[k].evidence,
                     VerifiedPair::overlap_of(outcome.modes[k])});
  const std::vector<VerifiedPair::Candidate> alternatives =
      found != nullptr ? pair.alternatives_of(*found) : given;
  for (std::size_t k = 0; k < poses.size(); ++k) {
    if (pair.contradicts_common_view(outcome.modes[k])) continue;  // the confidence stays 0
    const confidence::ModeConfidence confidence =
        pair.confidence_of(given[k], alternatives, poses[k].source_moments);
    poses[k].confidence = confidence.confidence;
    poses[k].overlap_confidence = confidence.overlap_confidence;
  }
}

using Verifications = std::vector<std::vector<PoseVerification>>;

/// Calls work(k) for the pairs of a chunk. Evidence and confidence of a pose take tens of
/// microseconds on the host, too much for one thread where a device measures thousands per second.
template <typename Work>
void for_each_pair(const Engine& engine, std::size_t count, const Work& work) {
  for_each_on(std::min<std::size_t>(engine.host_threads(), 1 + count / 16), count, work);
}

/// Verifies the pairs chunk by chunk. conclude(engine, inputs, pairs, outcomes, results): sets the
/// confidences of a chunk. matches: given ones, for all pairs; empty: of the features.
template <typename Conclude>
Verifications verify_pairs(const Context& context, const std::vector<PreparedCloud>& clouds,
                           const std::vector<Pair>& pairs,
                           const std::vector<std::vector<UnalignedIsometry3d>>& poses,
                           const RegistrationSettings& options, bool refine,
                           Span<const std::uint32_t> matches, const Conclude& conclude) {
  options.validate();
  if (poses.size() != pairs.size())
    throw InvalidArgument("poses has " + std::to_string(poses.size()) + " entries, but pairs has " +
                          std::to_string(pairs.size()));
  check_pairs(context, clouds, pairs, options);
  if (matches.size == 0)
    for (const Pair& pair : pairs)
      check_features(*Access::state(clouds[pair.source]), *Access::state(clouds[pair.target]));
  for (std::size_t p = 0; p < poses.size(); ++p)
    for (std::size_t k = 0; k < poses[p].size(); ++k)
      require_rigid(poses[p][k], "poses[" + std::to_string(p) + "][" + std::to_string(k) + "]");

  Engine& engine = *Access::engine(context);
  RegistrationSettings by_evidence = options;
  by_evidence.method = RegistrationMethod::compatibility;
  Verifications results(pairs.size());
  const std::vector<PairVariant> variants = variants_of(clouds, pairs, by_evidence);
  const std::size_t chunk = engine.pairs_per_chunk(by_evidence);
  for (std::size_t begin = 0; begin < variants.size(); begin += chunk) {
    StopScope::poll();
    const std::size_t end = std::min(variants.size(), begin + chunk);
    std::vector<PairInput> inputs;
    std::vector<VerifiedPair> verified;
    std::vector<std::vector<Pose<double>>> local(end - begin);
    for (std::size_t v = begin; v < end; ++v) {
      const VerifiedPair pair{variants[v].clouds};
      verified.push_back(pair);
      inputs.push_back(pair.input());
      if (pair.source.size > 0 && pair.target.size > 0)
        inputs.back().custom_source = inputs.back().custom_target = matches;
      for (const UnalignedIsometry3d& pose : poses[variants[v].pair])
        local[v - begin].push_back(pair.local_of(pose));
    }
    const std::vector<PairOutcome> outcomes =
        verify_all(engine, inputs, local, by_evidence, refine);
    Verifications made(outcomes.size());
    for_each_pair(engine, made.size(),
                  [&](std::size_t v) { made[v] = measured(verified[v], outcomes[v]); });
    conclude(engine, inputs, verified, outcomes, made);
    for (std::size_t v = begin; v < end; ++v) {
      const std::size_t p = variants[v].pair;
      const VerifiedPair& pair = verified[v - begin];
      std::vector<PoseVerification>& poses_of_pair = made[v - begin];
      for (std::size_t k = 0; k < poses_of_pair.size(); ++k) {
        PoseVerification& out = poses_of_pair[k];
        if (refine)
          move_to_frame(out.target_from_source, pair.source, pair.target);
        else
          out.target_from_source = poses[p][k];
        move_to_frame(out.source_moments, pair.source);
        move_to_frame(out.target_moments, pair.target);
      }
      keep_more_confident(std::move(poses_of_pair), results[p]);
    }
  }
  return results;
}

}  // namespace

std::vector<std::vector<PoseVerification>> verify_poses_batch(
    const Context& context, const std::vector<PreparedCloud>& clouds,
    const std::vector<Pair>& pairs, const std::vector<std::vector<UnalignedIsometry3d>>& poses,
    const RegistrationSettings& options, const VerificationOptions& verification) {
  return verify_pairs(context, clouds, pairs, poses, options, verification.refine, {},
                      [&](Engine& engine, const std::vector<PairInput>& inputs,
                          const std::vector<VerifiedPair>& verified,
                          const std::vector<PairOutcome>& outcomes, Verifications& made) {
                        std::vector<PairOutcome> found(inputs.size());
                        if (verification.search_alternatives)
                          align_all(engine, span_of(inputs), verified.front().options,
                                    {found.data(), found.size()});
                        for_each_pair(engine, made.size(), [&](std::size_t v) {
                          set_confidences(verified[v], outcomes[v],
                                          verification.search_alternatives ? &found[v] : nullptr,
                                          made[v]);
                        });
                      });
}

std::vector<std::vector<PoseVerification>> verify_poses_batch(
    const Context& context, const std::vector<PreparedCloud>& clouds,
    const std::vector<Pair>& pairs, const std::vector<std::vector<UnalignedIsometry3d>>& poses,
    const RegistrationOptions& options, const VerificationOptions& verification) {
  return verify_poses_batch(context, clouds, pairs, poses, resolve(options), verification);
}

Verifications verify_by_surfaces(const Context& context, const std::vector<PreparedCloud>& clouds,
                                 const std::vector<Pair>& pairs,
                                 const std::vector<std::vector<UnalignedIsometry3d>>& poses,
                                 const RegistrationSettings& options, bool refine,
                                 const std::function<double(const PoseVerification&)>& confidence) {
  const std::uint32_t first = 0;  // a match that the evidence of surfaces does not look at
  return verify_pairs(context, clouds, pairs, poses, options, refine, {&first, 1},
                      [&](Engine&, const std::vector<PairInput>&, const std::vector<VerifiedPair>&,
                          const std::vector<PairOutcome>&, Verifications& made) {
                        for (std::vector<PoseVerification>& of_pair : made)
                          for (PoseVerification& pose : of_pair) pose.confidence = confidence(pose);
                      });
}

std::vector<PoseVerification> verify_poses(const Context& context, const PreparedCloud& source,
                                           const PreparedCloud& target,
                                           const std::vector<UnalignedIsometry3d>& poses,
                                           const RegistrationSettings& options,
                                           const VerificationOptions& verification) {
  return verify_poses_batch(context, {source, target}, {{0, 1}}, {poses}, options, verification)
      .front();
}

std::vector<PoseVerification> verify_poses(const Context& context, const PreparedCloud& source,
                                           const PreparedCloud& target,
                                           const std::vector<UnalignedIsometry3d>& poses,
                                           const RegistrationOptions& options,
                                           const VerificationOptions& verification) {
  return verify_poses(context, source, target, poses, resolve(options), verification);
}

}  // namespace gpureg
