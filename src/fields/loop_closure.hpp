// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "fields/options.hpp"
#include "fields/reconstruction.hpp"
#include "gpureg/loop_closure.hpp"

namespace gpureg::fields {

template <>
struct Fields<loop_closure::ProposalOptions> {
  static constexpr const char* kName = "LoopProposalOptions";
  static constexpr const char* kGroup = "proposals.";
  static constexpr const char* kSentence =
      "Which pairs of fragments are registered without being asked for.";

  // clang-format off: a field is a line.
  template <typename V>
  static void visit(V&& v) {
    using O = loop_closure::ProposalOptions;
    v(&O::coarse_voxel_size, {"coarse_voxel_size", kPositive.in_voxels(), "Edge of the coarse voxels that say what a fragment observed."});
    v(&O::min_overlap, {"min_overlap", kPositiveUpToOne, "Smallest expected overlap, within the uncertainty of the relative pose."});
    v(&O::max_dilation, {"max_dilation", kNotNegative.in_voxels(), "Largest distance by which the uncertainty may widen the search."});
    v(&O::min_uncertainty, {"min_uncertainty", kNotNegative.in_voxels(), "Pairs whose relative pose is known better than this are not proposed: standard deviation of the translation."});
    v(&O::min_time, {"min_time", kNotNegative.in("seconds"), "Pairs of one session closer in time are not proposed."});
    v(&O::per_fragment, {"per_fragment", "Proposals of a fragment with earlier fragments of its frame."});
    v(&O::between_frames, {"between_frames", "Proposals of a fragment with fragments that nothing connects it to."});
    v(&O::confirming_candidate, {"confirming_candidate", "Proposals that would confirm or refute one candidate."});
  }
  // clang-format on
};

template <>
struct Fields<loop_closure::AcceptanceOptions> {
  static constexpr const char* kName = "LoopAcceptanceOptions";
  static constexpr const char* kGroup = "acceptance.";
  static constexpr const char* kSentence = "When a loop is accepted.";

  // clang-format off: a field is a line.
  template <typename V>
  static void visit(V&& v) {
    using O = loop_closure::AcceptanceOptions;
    v(&O::min_confidence, {"min_confidence", kWithinOne, "Registered poses below take no part."});
    v(&O::alone, {"alone", kPositiveUpToOne, "Confidence from which one loop within the drift of odometry suffices."});
    v(&O::confirmed, {"confirmed", kUpToOne, "Least confidence of a loop that others confirm."});
    v(&O::together, {"together", kPositiveUpToOne, "Probability that one of several independent loops that agree is correct, from which they suffice."});
    v(&O::between_frames, {"between_frames", kPositiveUpToOne, "The same between sessions, or parts of one, that odometry does not connect."});
    v(&O::same_place_overlap, {"same_place_overlap", kUpToOne, "Two fragments of one frame with a larger overlap are at one place."});
    v(&O::drift_probability, {"drift_probability", kWithinOne, "Quantile of the misclosure under odometry's uncertainty within which a loop may stand alone."});
    v(&O::max_drift_ratio, {"max_drift_ratio", from(1, kMost, "a finite number >= 1"), "Largest drift_ratio of a loop at which it may be accepted at all."});
  }
  // clang-format on
};

template <>
struct Fields<loop_closure::Options> {
  static constexpr const char* kName = "LoopClosureOptions";
  static constexpr const char* kGroup = "";
  static constexpr const char* kSentence =
      "Options of a LoopCloser. Lengths are in voxels, but for those of graph.";

  // clang-format off: a field is a line.
  template <typename V>
  static void visit(V&& v) {
    using O = loop_closure::Options;
    v(&O::registration, {"registration", "Registration of two fragments."});
    v(&O::proposals, {"proposals", "Which pairs are registered."});
    v(&O::acceptance, {"acceptance", "When a loop is accepted."});
    v(&O::noise, {"noise", "Noise of registered poses."});
    v(&O::information_unit, {"information_unit", kPositive.in_voxels(), "Length in which the information eigenvalues count rotations."});
    v(&O::host_noise, {"host_noise", "Noise of loops of the host without information, in place of graph.loop_noise."});
    v(&O::graph, {"graph", "Optimisation: robust kernel, drift of odometry without covariance."});
    v(&O::drift_correlation, {"drift_correlation", kNotNegative.in_voxels(), "Distance over which errors of odometry without covariance have one sign; 0: independent errors."});
    v(&O::gravity_sigma, {"gravity_sigma", Range{1e-6, 180, true, false, true, "0, or degrees in (1e-6, 180]", "degrees"}, "Standard deviation of the up direction of fragments in the graph; 0: not used there."});
    v(&O::modes, {"modes", from(1, 16), "Poses of a pair that compete in the graph."});
    v(&O::chunk, {"chunk", from(1, kInfinity), "Registrations between two looks at the clock."});
    v(&O::optimize, {"optimize", "Whether poses are optimised here, or left to the host."});
    v(&O::information_from_correspondences, {"information_from_correspondences", "Whether the information of a loop is the sum of G'G over its correspondences, as LoopSmart has it, or from noise."});
    v(&O::accept_by_graph_alone, {"accept_by_graph_alone", "Whether a loop that the graph accepts is accepted without asking acceptance."});
  }
  // clang-format on
};

}  // namespace gpureg::fields
