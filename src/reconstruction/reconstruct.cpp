// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <map>
#include <set>
#include <string>
#include <utility>

#include "fields/in_units.hpp"
#include "fields/reconstruction.hpp"
#include "gpureg/error.hpp"
#include "gpureg/reconstruction.hpp"
#include "math/exponential.hpp"
#include "reconstruction/connections.hpp"
#include "reconstruction/edge_noise.hpp"
#include "reconstruction/odometry.hpp"

namespace gpureg::reconstruction {
namespace {

/// Confidences of 0 and 1 would never, or always, be accepted.
constexpr double kCertain = 0.999;
/// A further mode of a pair takes part from this confidence.
constexpr double kMinAlternative = 0.02;
/// Connections are rejected and the rest optimised again at most so often; each round removes
/// edges, and the first one removes nearly all.
constexpr int kMostDrops = 8;

void check_pairs(std::size_t scans, const std::vector<Pair>& pairs) {
  std::set<std::pair<std::uint32_t, std::uint32_t>> seen;
  for (std::size_t k = 0; k < pairs.size(); ++k) {
    const auto [a, b] = std::minmax({pairs[k].source, pairs[k].target});
    const auto where = [&, k] { return "pairs[" + std::to_string(k) + "]"; };
    if (b >= scans)
      throw InvalidArgument(where() + " names cloud " + std::to_string(b) + " of " +
                            std::to_string(scans));
    if (a == b) throw InvalidArgument(where() + " is a cloud with itself");
    if (!seen.insert({a, b}).second) throw InvalidArgument(where() + " repeats another pair");
  }
}

/// Covariance of its points; 0 where it is not known.
Eigen::Matrix3d overlap_spread(const RegistrationResult& result) {
  const CorrespondenceMoments& moments = result.source_moments;
  if (moments.count == 0) return Eigen::Matrix3d::Zero();
  const auto count = static_cast<double>(moments.count);
  const Eigen::Vector3d mean = moments.sum / count;
  return moments.outer / count - mean * mean.transpose();
}

/// The modes of a result, of which methods without modes have one.
std::vector<RegistrationMode> modes_of(const RegistrationResult& result) {
  if (!result.modes.empty()) return result.modes;
  RegistrationMode only;
  only.target_from_source = result.target_from_source;
  only.confidence = result.confidence;
  return {only};
}

/// A mode of an edge with the confidence that takes part.
struct Candidate {
  std::uint32_t mode = 0;
  double confidence = 0;
  double alone = 0;  ///< before loop consistency
};

/// The mode that loop consistency chose, then the others by confidence. What the chosen one gains
/// or loses by loops, the others lose or gain.
std::vector<Candidate> candidates_of(const std::vector<RegistrationMode>& modes,
                                     const PairConsistency& pair, const Options& options) {
  std::vector<Candidate> out = {{pair.mode, std::min(pair.confidence, kCertain),
                                 std::min(modes[pair.mode].confidence, kCertain)}};
  const double alone = modes[pair.mode].confidence;
  const double share = alone < 1 ? std::min(1.0, (1 - pair.confidence) / (1 - alone)) : 0;
  for (std::uint32_t k = 0; k < modes.size() && out.size() < options.modes; ++k) {
    const double confidence = modes[k].confidence * share;
    if (k != pair.mode && confidence >= kMinAlternative)
      out.push_back({k, std::min(confidence, kCertain), std::min(modes[k].confidence, kCertain)});
  }
  return out;
}

/// The graph of the pairs that are confident enough.
struct PairGraph {
  pose_graph::Graph graph;                         ///< without the odometry
  std::vector<std::size_t> pairs;                  ///< of each edge
  std::vector<Eigen::Vector3d> centres;            ///< of the overlap of each edge
  std::vector<Eigen::Matrix3d> spreads;            ///< the same
  std::vector<std::vector<Candidate>> candidates;  ///< of each edge
};

PairGraph graph_of_pairs(std::size_t scans, const std::vector<Pair>& pairs,
                         const std::vector<RegistrationResult>& results,
                         const std::vector<PairConsistency>& consistency, const Options& options) {
  PairGraph out;
  for (std::size_t k = 0; k < scans; ++k) out.graph.nodes.push_back({static_cast<std::int64_t>(k)});
  for (std::size_t k = 0; k < pairs.size(); ++k) {
    if (!results[k].has_pose() || consistency[k].confidence < options.min_edge_confidence) continue;
    const std::vector<RegistrationMode> modes = modes_of(results[k]);
    const std::vector<Candidate> candidates = candidates_of(modes, consistency[k], options);
    const Eigen::Vector3d centre = overlap_centre(results[k]);
    const auto information = [&](const Candidate& candidate) {
      return edge_information(modes[candidate.mode], centre, options.noise,
                              options.information_unit, results[k].flat);
    };
    pose_graph::Edge edge;
    edge.source = pairs[k].source;
    edge.target = pairs[k].target;
    edge.target_from_source = modes[candidates[0].mode].target_from_source;
    edge.information = information(candidates[0]);
    edge.confidence = candidates[0].confidence;
    for (std::size_t m = 1; m < candidates.size(); ++m)
      edge.alternatives.push_back({modes[candidates[m].mode].target_from_source,
                                   information(candidates[m]), candidates[m].confidence});
    out.graph.edges.push_back(std::move(edge));
    out.pairs.push_back(k);
    out.centres.push_back(centre);
    out.spreads.push_back(overlap_spread(results[k]));
    out.candidates.push_back(candidates);
  }
  return out;
}

/// What the optimisation says about one edge.
Edge edge_of(const PairGraph& pairs, std::size_t k, const pose_graph::EdgeResult& result) {
  const pose_graph::Edge& given = pairs.graph.edges[k];
  Edge edge;
  edge.source = static_cast<std::uint32_t>(given.source);
  edge.target = static_cast<std::uint32_t>(given.target);
  edge.pair = pairs.pairs[k];
  edge.overlap_centre = pairs.centres[k];
  edge.overlap_spread = pairs.spreads[k];
  edge.mode = pairs.candidates[k][result.mode].mode;
  edge.confidence = edge.map_confidence = pairs.candidates[k][result.mode].confidence;
  edge.pair_confidence = pairs.candidates[k][result.mode].alone;
  const bool first = result.mode == 0;
  edge.target_from_source =
      first ? given.target_from_source : given.alternatives[result.mode - 1].target_from_source;
  edge.information = first ? *given.information : *given.alternatives[result.mode - 1].information;
  edge.weight = result.weight;
  edge.accepted = result.state == pose_graph::EdgeState::accepted;
  edge.reason = edge.accepted ? EdgeReason::none : EdgeReason::inconsistent;
  return edge;
}

/// What one optimisation says.
struct Round {
  pose_graph::Result result;
  std::vector<Edge> edges;           ///< all
  Agreement agreement;               ///< before connections are cut
  std::vector<std::uint32_t> parts;  ///< of each scan: the part that accepted edges connect it to
  bool dropped = false;              ///< an edge turned out to be unconfirmed
};

/// Of the first round, which has all edges.
Agreement agreement_of(const std::vector<Edge>& edges) {
  Agreement out;
  double all = 0, contradicted = 0;
  std::set<std::uint32_t> scans;
  for (const Edge& edge : edges) {
    // How surprising it would be that the pair is wrong. It is at most kCertain.
    const double evidence = -portable::log(1 - edge.pair_confidence);
    all += evidence;
    if (!edge.accepted) contradicted += evidence;
    out.edges_per_scan += edge.accepted;
    scans.insert({edge.source, edge.target});
  }
  if (all > 0) out.contradicted = contradicted / all;
  if (!scans.empty()) out.edges_per_scan /= static_cast<double>(scans.size());
  return out;
}

/// A rejected edge that is alone between two parts contradicts nothing: it is not confident enough
/// to connect them.
void name_lone_edges(const std::vector<std::uint32_t>& parts, std::vector<Edge>& edges) {
  std::map<std::pair<std::uint32_t, std::uint32_t>, std::size_t> between;
  const auto parts_of = [&](const Edge& edge) {
    const auto [low, high] = std::minmax(parts[edge.source], parts[edge.target]);
    return std::pair(low, high);
  };
  for (const Edge& edge : edges) ++between[parts_of(edge)];
  for (Edge& edge : edges)
    if (!edge.accepted && parts[edge.source] != parts[edge.target] && between[parts_of(edge)] == 1)
      edge.reason = EdgeReason::unconfirmed;
}

/// Optimises without the edges that are unconfirmed; adds those among the rest that turn out to be
/// unconfirmed now.
Round optimise_round(std::size_t scans, const PairGraph& pairs,
                     const std::vector<Odometry>& odometry, const Options& options,
                     std::vector<char>& unconfirmed) {
  pose_graph::Graph graph;
  graph.nodes = pairs.graph.nodes;
  std::vector<std::size_t> kept;
  for (std::size_t k = 0; k < pairs.graph.edges.size(); ++k)
    if (!unconfirmed[k]) {
      graph.edges.push_back(pairs.graph.edges[k]);
      kept.push_back(k);
    }
  for (const Odometry& edge : odometry) graph.edges.push_back(edge_of(edge));
  pose_graph::Options graph_options;
  graph_options.threads = options.threads;
  graph_options.gnc.min_bridge_confidence = options.min_connection_confidence;
  Round round;
  round.result = pose_graph::optimize(graph, graph_options);
  // A rejected edge shows the mode that the pair prefers.
  for (std::size_t k = 0; k < pairs.graph.edges.size(); ++k) {
    round.edges.push_back(edge_of(pairs, k, {}));
    round.edges.back().reason = EdgeReason::unconfirmed;
  }
  for (std::size_t k = 0; k < kept.size(); ++k) {
    pose_graph::EdgeResult result = round.result.edges[k];
    if (result.state == pose_graph::EdgeState::rejected) result.mode = 0;
    round.edges[kept[k]] = edge_of(pairs, kept[k], result);
  }
  round.agreement = agreement_of(round.edges);
  round.parts = certain_parts(scans, round.edges, odometry, options.min_connection_confidence);
  split_at_weak_links(round.edges, odometry, options.min_connection_confidence, round.parts);
  for (std::size_t k = 0; k < round.edges.size(); ++k) {
    Edge& edge = round.edges[k];
    if (!edge.accepted || round.parts[edge.source] == round.parts[edge.target]) continue;
    edge.accepted = false;
    edge.weight = 0;
    edge.reason = EdgeReason::unconfirmed;
    unconfirmed[k] = 1;
    round.dropped = true;
  }
  name_lone_edges(round.parts, round.edges);
  return round;
}

/// Parts that accepted edges connect, the largest first.
std::vector<Island> islands_of(const Reconstruction& map, const std::vector<std::uint32_t>& parts,
                               std::uint32_t min_island) {
  std::vector<Island> all(map.scans.size()), out;
  for (std::uint32_t k = 0; k < parts.size(); ++k) all[parts[k]].scans.push_back(k);
  for (Island& island : all)
    if (island.scans.size() >= min_island) out.push_back(std::move(island));
  std::stable_sort(out.begin(), out.end(), [](const Island& a, const Island& b) {
    return a.scans.size() > b.scans.size();
  });
  return out;
}

/// Poses in the frame of the island's smallest scan.
void place(const pose_graph::Result& result, Reconstruction& map) {
  for (std::uint32_t k = 0; k < map.islands.size(); ++k) {
    const std::vector<std::uint32_t>& scans = map.islands[k].scans;
    const UnalignedIsometry3d island_from_world = result.world_from_node[scans[0]].inverse();
    for (const std::uint32_t scan : scans) {
      map.scans[scan].placed = true;
      map.scans[scan].reason = ScanReason::none;
      map.scans[scan].island = k;
      map.scans[scan].island_from_scan = island_from_world * result.world_from_node[scan];
    }
    map.scans[scans[0]].island_from_scan.setIdentity();
  }
}

bool too_few_points(RegistrationReason reason, bool source) {
  return reason == (source ? RegistrationReason::too_few_source_points
                           : RegistrationReason::too_few_target_points);
}

/// Reason and confidence of the scans that are left out.
void explain(const std::vector<Pair>& pairs, const std::vector<RegistrationResult>& results,
             const std::vector<PairConsistency>& consistency, Reconstruction& map) {
  std::vector<std::size_t> tried(map.scans.size(), 0), too_few(map.scans.size(), 0);
  for (std::size_t k = 0; k < pairs.size(); ++k) {
    if (results[k].status == RegistrationStatus::skipped) continue;
    for (const bool source : {true, false}) {
      const std::uint32_t scan = source ? pairs[k].source : pairs[k].target;
      ++tried[scan];
      too_few[scan] += too_few_points(results[k].reason, source);
      if (!map.scans[scan].placed)
        map.scans[scan].confidence =
            std::max(map.scans[scan].confidence, consistency[k].confidence);
    }
  }
  std::vector<char> accepted(map.scans.size(), 0), rejected(accepted), unconfirmed(accepted);
  for (const Edge& edge : map.edges)
    for (const std::uint32_t scan : {edge.source, edge.target}) {
      accepted[scan] |= edge.accepted;
      rejected[scan] |= edge.reason == EdgeReason::inconsistent;
      unconfirmed[scan] |= edge.reason == EdgeReason::unconfirmed;
    }
  for (std::size_t k = 0; k < map.scans.size(); ++k) {
    Scan& scan = map.scans[k];
    if (scan.placed) continue;
    if (tried[k] == 0)
      scan.reason = ScanReason::not_tried;
    else if (accepted[k])
      scan.reason = ScanReason::small_island;
    else if (unconfirmed[k])
      scan.reason = ScanReason::unconfirmed;
    else if (rejected[k])
      scan.reason = ScanReason::contradicted;
    else if (too_few[k] == tried[k])
      scan.reason = ScanReason::too_few_points;
    else
      scan.reason = ScanReason::no_confident_pair;
  }
}

}  // namespace

Reconstruction reconstruct_from_poses(std::size_t scans, const std::vector<Pair>& pairs,
                                      const std::vector<RegistrationResult>& results,
                                      const Options& given, const std::vector<Odometry>& odometry) {
  given.validate();
  const Options options = fields::in_units(given, given.voxel_size);
  check_pairs(scans, pairs);
  Reconstruction map;
  map.odometry = checked_odometry(scans, odometry, options.drift);
  LoopConsistencyOptions consistency_options = given.consistency;
  consistency_options.voxel_size = given.voxel_size;
  consistency_options.threads = options.threads;
  const std::vector<PairConsistency> consistency =
      loop_consistency(pairs, results, consistency_options);
  const PairGraph graph = graph_of_pairs(scans, pairs, results, consistency, options);

  std::vector<char> unconfirmed(graph.graph.edges.size(), 0);
  Round round = optimise_round(scans, graph, map.odometry, options, unconfirmed);
  map.agreement = round.agreement;
  for (int k = 1; round.dropped && k < kMostDrops; ++k)
    round = optimise_round(scans, graph, map.odometry, options, unconfirmed);

  map.status = round.result.status;
  map.scans.resize(scans);
  map.edges = std::move(round.edges);
  map.islands = islands_of(map, round.parts, options.min_island);
  place(round.result, map);
  explain(pairs, results, consistency, map);
  set_confidence(map);
  return map;
}

}  // namespace gpureg::reconstruction
