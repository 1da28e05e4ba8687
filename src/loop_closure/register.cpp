// SPDX-License-Identifier: BSD-3-Clause
#include "loop_closure/register.hpp"

#include <algorithm>
#include <map>

#include "pose_graph/validate.hpp"
#include "reconstruction/edge_noise.hpp"

namespace gpureg::loop_closure {
namespace {

/// Confidences of 1 would make a loop that nothing can reject.
constexpr double kCertain = 0.999;
/// A further mode of a pair takes part from this confidence.
constexpr double kMinAlternative = 0.02;

std::vector<RegistrationMode> modes_of(const RegistrationResult& result) {
  if (!result.modes.empty()) return result.modes;
  RegistrationMode only;
  only.target_from_source = result.target_from_source;
  only.confidence = result.confidence;
  return {only};
}

/// @param result that `given` is a mode of.
Mode mode_of(const RegistrationMode& given, const RegistrationResult& result,
             const Options& options) {
  const CorrespondenceMoments& moments = result.source_moments;
  Mode mode;
  mode.target_from_source = given.target_from_source;
  mode.confidence = std::min(given.confidence, kCertain);
  const Eigen::Vector3d centre = moments.count == 0
                                     ? Eigen::Vector3d(Eigen::Vector3d::Zero())
                                     : Eigen::Vector3d(moments.sum / double(moments.count));
  if (options.information_from_correspondences && moments.count > 0)
    mode.information = moments.information_open3d();
  else
    mode.information = reconstruction::edge_information(given, centre, options.noise,
                                                        options.information_unit, result.flat);
  // A lever of kilometres to the origin of the cloud makes a rotation as certain.
  const double largest = mode.information.cwiseAbs().maxCoeff();
  if (largest > pose_graph::kLargestInformation)
    mode.information *= 0.5 * pose_graph::kLargestInformation / largest;
  return mode;
}

RegistrationPrior prior_of(const State& state, const Proposal& proposal) {
  RegistrationPrior prior = proposal.prior ? *proposal.prior : RegistrationPrior{};
  const Node& source = state.nodes.at(proposal.source);
  const Node& target = state.nodes.at(proposal.target);
  if (!prior.gravity && source.up && target.up) {
    GravityPrior gravity;
    gravity.source_up = *source.up;
    gravity.target_up = *target.up;
    prior.gravity = gravity;
  }
  return prior;
}

}  // namespace

LoopRecord record_of(FragmentId source, FragmentId target, const RegistrationResult& result,
                     const Options& options) {
  LoopRecord record;
  record.source = record.loop.source = source;
  record.target = record.loop.target = target;
  record.loop.state = LoopState::rejected;
  record.loop.reason = LoopReason::not_aligned;
  if (!result.has_pose()) return record;
  record.loop.target_from_source = result.target_from_source;
  record.loop.confidence = result.confidence;
  std::vector<RegistrationMode> modes = modes_of(result);
  if (modes.front().confidence < options.acceptance.min_confidence) return record;
  for (const RegistrationMode& mode : modes) {
    if (record.modes.size() >= options.modes) break;
    if (record.modes.empty() || mode.confidence >= kMinAlternative)
      record.modes.push_back(mode_of(mode, result, options));
  }
  choose_mode(record, 0);
  return record;
}

std::vector<RegistrationResult> register_all(const Context& context, const State& state,
                                             const std::vector<Proposal>& proposals,
                                             const Options& options) {
  std::vector<PreparedCloud> clouds;
  std::map<FragmentId, std::uint32_t> places;
  const auto place = [&](FragmentId id) {
    const auto [at, fresh] = places.try_emplace(id, static_cast<std::uint32_t>(clouds.size()));
    if (fresh) clouds.push_back(state.nodes.at(id).cloud);
    return at->second;
  };
  std::vector<Pair> pairs;
  std::vector<RegistrationPrior> priors;
  for (const Proposal& proposal : proposals) {
    pairs.push_back({place(proposal.source), place(proposal.target)});
    priors.push_back(prior_of(state, proposal));
  }
  return align_batch(context, clouds, pairs, options.registration, {}, priors);
}

}  // namespace gpureg::loop_closure
