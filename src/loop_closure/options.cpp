// SPDX-License-Identifier: BSD-3-Clause
#include <cmath>

#include "common/validate.hpp"
#include "gpureg/loop_closure.hpp"

namespace gpureg::loop_closure {
namespace {

bool positive(double v) { return std::isfinite(v) && v > 0; }
bool not_negative(double v) { return std::isfinite(v) && v >= 0; }

/// The voxel size that the defaults are for.
constexpr double kDefaultVoxel = 0.05;

}  // namespace

void ProposalOptions::validate() const {
  require(positive(coarse_voxel_size), "proposals.coarse_voxel_size", coarse_voxel_size,
          "a finite number > 0");
  require(min_overlap > 0 && min_overlap <= 1, "proposals.min_overlap", min_overlap, "(0, 1]");
  require(not_negative(max_dilation), "proposals.max_dilation", max_dilation,
          "a finite number >= 0");
  require(not_negative(min_uncertainty), "proposals.min_uncertainty", min_uncertainty,
          "a finite number >= 0");
  require(not_negative(min_time), "proposals.min_time", min_time, "a finite number >= 0");
}

void AcceptanceOptions::validate() const {
  require(min_confidence > 0 && min_confidence < 1, "acceptance.min_confidence", min_confidence,
          "(0, 1)");
  require(alone > 0 && alone <= 1, "acceptance.alone", alone, "(0, 1]");
  require(confirmed >= 0 && confirmed <= 1, "acceptance.confirmed", confirmed, "[0, 1]");
  require(together > 0 && together <= 1, "acceptance.together", together, "(0, 1]");
  require(between_frames > 0 && between_frames <= 1, "acceptance.between_frames", between_frames,
          "(0, 1]");
  require(same_place_overlap >= 0 && same_place_overlap <= 1, "acceptance.same_place_overlap",
          same_place_overlap, "[0, 1]");
  require(drift_probability > 0 && drift_probability < 1, "acceptance.drift_probability",
          drift_probability, "(0, 1)");
  require(std::isfinite(max_drift_ratio) && max_drift_ratio >= 1, "acceptance.max_drift_ratio",
          max_drift_ratio, "a finite number >= 1");
}

Options Options::from_voxel_size(float voxel_size) {
  Options options;
  options.registration = RegistrationOptions::from_voxel_size(voxel_size);
  const double scale = static_cast<double>(voxel_size) / kDefaultVoxel;
  options.proposals.coarse_voxel_size *= scale;
  options.proposals.max_dilation *= scale;
  options.proposals.min_uncertainty *= scale;
  options.noise.translation *= scale;
  options.noise.max_translation *= scale;
  options.information_unit *= scale;
  options.graph.loop_noise.translation *= scale;
  options.drift_correlation *= scale;
  return options;
}

Options Options::loopsmart() {
  Options options;
  options.graph = pose_graph::Options::loopsmart();
  options.information_from_correspondences = true;
  options.accept_by_graph_alone = true;
  options.drift_correlation = 0;
  options.modes = 1;
  return options;
}

void Options::validate() const {
  registration.validate();
  proposals.validate();
  acceptance.validate();
  noise.validate();
  graph.validate();
  require(positive(information_unit), "information_unit", information_unit, "a finite number > 0");
  require(not_negative(drift_correlation), "drift_correlation", drift_correlation,
          "a finite number >= 0");
  require(not_negative(gravity_sigma), "gravity_sigma", gravity_sigma, "a finite number >= 0");
  require(modes >= 1 && modes <= 16, "modes", modes, "1 to 16");
  require(chunk >= 1, "chunk", chunk, "1 or more");
}

const char* to_string(LoopState state) {
  switch (state) {
    case LoopState::candidate:
      return "candidate";
    case LoopState::accepted:
      return "accepted";
    case LoopState::rejected:
      return "rejected";
    case LoopState::retracted:
      return "retracted";
  }
  return "unknown";
}

const char* to_string(LoopReason reason) {
  switch (reason) {
    case LoopReason::confident:
      return "confident";
    case LoopReason::confirmed:
      return "confirmed";
    case LoopReason::by_graph:
      return "by_graph";
    case LoopReason::unconfirmed:
      return "unconfirmed";
    case LoopReason::exceeds_drift:
      return "exceeds_drift";
    case LoopReason::not_aligned:
      return "not_aligned";
    case LoopReason::inconsistent:
      return "inconsistent";
    case LoopReason::lost_confirmation:
      return "lost_confirmation";
    case LoopReason::fragment_removed:
      return "fragment_removed";
  }
  return "unknown";
}

const char* describe(LoopReason reason) {
  switch (reason) {
    case LoopReason::confident:
      return "the registration is confident, and the drift of odometry explains the loop";
    case LoopReason::confirmed:
      return "independent loops agree with it";
    case LoopReason::by_graph:
      return "the robust graph accepts it, and no other rule was asked for";
    case LoopReason::unconfirmed:
      return "it fits, but it is not confident enough alone, and no other loop confirms it";
    case LoopReason::exceeds_drift:
      return "it is farther from odometry than the drift of odometry explains";
    case LoopReason::not_aligned:
      return "no pose of the pair is confident enough to take part";
    case LoopReason::inconsistent:
      return "it contradicts odometry and the other loops";
    case LoopReason::lost_confirmation:
      return "the loops that confirmed it do not take part any more";
    case LoopReason::fragment_removed:
      return "one of its fragments was removed before it was accepted";
  }
  return "unknown";
}

}  // namespace gpureg::loop_closure
