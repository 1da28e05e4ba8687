// SPDX-License-Identifier: BSD-3-Clause
#include "loop_closure/options.hpp"
#include "fields/in_units.hpp"
#include "fields/loop_closure.hpp"
#include "fields/validate.hpp"

namespace gpureg::loop_closure {

void ProposalOptions::validate() const { fields::validate(*this); }
void AcceptanceOptions::validate() const { fields::validate(*this); }
void Options::validate() const { fields::validate(*this); }

Options in_units(const Options& options) {
  options.validate();
  const float voxel_size = options.registration.voxel_size;
  Options out = fields::in_units(options, voxel_size);
  out.graph.loop_noise = {fields::length_of(options.host_noise.translation, voxel_size),
                          options.host_noise.rotation};
  return out;
}

Options Options::loopsmart(float voxel_size) {
  Options options{RegistrationOptions{voxel_size}};
  options.graph = pose_graph::Options::loopsmart();
  options.information_from_correspondences = true;
  options.accept_by_graph_alone = true;
  options.drift_correlation = 0;
  options.modes = 1;
  return options;
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
    case LoopReason::replaced:
      return "replaced";
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
    case LoopReason::replaced:
      return "it is accepted with another pose from now on";
  }
  return "unknown";
}

}  // namespace gpureg::loop_closure
