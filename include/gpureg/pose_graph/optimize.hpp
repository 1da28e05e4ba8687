// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "gpureg/pose_graph/graph.hpp"
#include "gpureg/pose_graph/options.hpp"
#include "gpureg/pose_graph/result.hpp"

namespace gpureg::pose_graph {

/// Estimates the poses of a graph and decides which loops are correct.
///
/// @param graph  any number of nodes and components.
/// @param options  validated first.
/// @return poses, edge states, components. The same bytes for the same graph on any number of
///   threads and for any order of nodes and edges. "Not converged" is a status.
/// @throws InvalidArgument naming field, place and value (Graph::validate, Options::validate, or a
///   marginal of an unknown node).
/// Thread-safe.
/// Sources: Yang et al., "Graduated Non-Convexity for Robust Spatial Perception", RA-L 2020; Choi
/// et al., "Robust Reconstruction of Indoor Scenes", CVPR 2015, section 4; Olson and Agarwal,
/// "Inference on Networks of Mixtures", RSS 2012 (several modes).
Result optimize(const Graph& graph, const Options& options = {});

}  // namespace gpureg::pose_graph
