// SPDX-License-Identifier: BSD-3-Clause
#include "reconstruction/scales/log_scale_graph.hpp"

#include <algorithm>
#include <utility>

#include "gpureg/pose_graph.hpp"
#include "gpureg/reconstruction.hpp"
#include "math/exponential.hpp"
#include "pose_graph/components.hpp"
#include "scale/limits.hpp"

namespace gpureg::reconstruction {
namespace {

/// A confidence of 1 would always be accepted.
constexpr double kNeverSurer = 0.999;

using PairOfScans = std::pair<int, int>;

/// The sets that links connect, counted in the order of their first scans.
std::vector<std::uint32_t> connected(std::size_t scans, const std::vector<PairOfScans>& links,
                                     const std::vector<char>& used) {
  pose_graph::UnionFind sets(static_cast<int>(scans));
  for (std::size_t k = 0; k < links.size(); ++k)
    if (used[k]) sets.merge(links[k].first, links[k].second);
  std::vector<std::uint32_t> out(scans);
  std::uint32_t next = 0;
  for (std::size_t k = 0; k < scans; ++k) {
    const auto root = static_cast<std::size_t>(sets.find(static_cast<int>(k)));
    out[k] = root == k ? next++ : out[root];
  }
  return out;
}

}  // namespace

AgreedScales agreed_scales(std::size_t scans, const std::vector<SearchedPair>& pairs) {
  // One axis of a pose graph: translations are logarithms of scales, all else agrees exactly.
  pose_graph::Graph graph;
  for (std::size_t k = 0; k < scans; ++k) graph.nodes.push_back({static_cast<std::int64_t>(k)});
  std::vector<PairOfScans> links;
  for (const SearchedPair& pair : pairs) {
    if (pair.candidates.empty()) continue;
    const auto pose_of = [](double scale) {
      UnalignedIsometry3d pose = UnalignedIsometry3d::Identity();
      pose.translation().x() = portable::log(scale);
      return pose;
    };
    const pose_graph::UnalignedMatrix6d information =
        pose_graph::UnalignedMatrix6d::Identity() /
        (scale::kOwnScale * scale::kOwnScale + pair.deviation * pair.deviation);
    const auto confidence_of = [](const ScaleCandidate& candidate) {
      return std::min(candidate.confidence, kNeverSurer);
    };
    pose_graph::Edge edge;
    edge.source = static_cast<std::int64_t>(pair.source);
    edge.target = static_cast<std::int64_t>(pair.target);
    edge.target_from_source = pose_of(pair.candidates[0].scale);
    edge.information = information;
    edge.confidence = confidence_of(pair.candidates[0]);
    for (std::size_t k = 1; k < pair.candidates.size(); ++k)
      edge.alternatives.push_back(
          {pose_of(pair.candidates[k].scale), information, confidence_of(pair.candidates[k])});
    graph.edges.push_back(std::move(edge));
    links.emplace_back(static_cast<int>(pair.source), static_cast<int>(pair.target));
  }
  pose_graph::Options options;
  options.threads = 1;
  options.gnc.min_bridge_confidence = Options().min_connection_confidence;
  const pose_graph::Result result = pose_graph::optimize(graph, options);

  std::vector<char> used;
  for (const pose_graph::EdgeResult& edge : result.edges)
    used.push_back(edge.state == pose_graph::EdgeState::accepted);
  AgreedScales out;
  out.parts = connected(scans, links, used);
  std::vector<char> on_loops = used;
  for (std::size_t k = 0; k < links.size(); ++k) {
    if (!used[k]) continue;
    used[k] = 0;
    const std::vector<std::uint32_t> without = connected(scans, links, used);
    on_loops[k] = without[static_cast<std::size_t>(links[k].first)] ==
                  without[static_cast<std::size_t>(links[k].second)];
    used[k] = 1;
  }
  out.settled = connected(scans, links, on_loops);
  std::vector<double> first(scans);
  std::vector<char> seen(scans, 0);
  for (std::size_t k = 0; k < scans; ++k) {
    const double x = result.world_from_node[k].translation().x();
    if (!std::exchange(seen[out.parts[k]], char{1})) first[out.parts[k]] = x;
    out.log_scales.push_back(x - first[out.parts[k]]);
  }
  return out;
}

}  // namespace gpureg::reconstruction
