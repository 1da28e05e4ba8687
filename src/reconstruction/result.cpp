// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <cmath>
#include <string>

#include "gpureg/error.hpp"
#include "gpureg/reconstruction.hpp"
#include "reconstruction/odometry.hpp"

namespace gpureg::reconstruction {

const char* to_string(ScanReason reason) {
  switch (reason) {
    case ScanReason::none:
      return "none";
    case ScanReason::odometry_only:
      return "odometry_only";
    case ScanReason::not_tried:
      return "not_tried";
    case ScanReason::too_few_points:
      return "too_few_points";
    case ScanReason::no_confident_pair:
      return "no_confident_pair";
    case ScanReason::contradicted:
      return "contradicted";
    case ScanReason::unconfirmed:
      return "unconfirmed";
    case ScanReason::small_island:
      return "small_island";
  }
  return "unknown";
}

const char* describe(ScanReason reason) {
  switch (reason) {
    case ScanReason::none:
      return "placed";
    case ScanReason::odometry_only:
      return "placed by odometry alone; no pair confirms it";
    case ScanReason::not_tried:
      return "no pair of the scan was aligned";
    case ScanReason::too_few_points:
      return "the scan has too few points";
    case ScanReason::no_confident_pair:
      return "the scan fits no other scan with confidence";
    case ScanReason::contradicted:
      return "the pairs of the scan contradict those of other scans";
    case ScanReason::unconfirmed:
      return "the pairs of the scan are not confident enough together";
    case ScanReason::small_island:
      return "the scan is connected to too few other scans";
  }
  return "unknown";
}

const char* to_string(EdgeReason reason) {
  switch (reason) {
    case EdgeReason::none:
      return "none";
    case EdgeReason::inconsistent:
      return "inconsistent";
    case EdgeReason::unconfirmed:
      return "unconfirmed";
  }
  return "unknown";
}

const char* describe(EdgeReason reason) {
  switch (reason) {
    case EdgeReason::none:
      return "accepted";
    case EdgeReason::inconsistent:
      return "contradicts the map that the other edges make";
    case EdgeReason::unconfirmed:
      return "not confident enough to connect two parts of the map";
  }
  return "unknown";
}

std::size_t Reconstruction::placed() const {
  return static_cast<std::size_t>(
      std::count_if(scans.begin(), scans.end(), [](const Scan& scan) { return scan.placed; }));
}

Reconstruction map_of_poses(const std::vector<UnalignedIsometry3d>& island_from_scan,
                            const std::vector<std::uint32_t>& islands) {
  if (!islands.empty() && islands.size() != island_from_scan.size())
    throw InvalidArgument("islands has " + std::to_string(islands.size()) +
                          " entries, expected none or one per scan, " +
                          std::to_string(island_from_scan.size()));
  Reconstruction map;
  map.scans.resize(island_from_scan.size());
  for (std::uint32_t k = 0; k < map.scans.size(); ++k) {
    if (!island_from_scan[k].matrix().allFinite()) continue;
    Scan& scan = map.scans[k];
    scan.placed = true;
    scan.reason = ScanReason::none;
    scan.island = islands.empty() ? 0 : islands[k];
    scan.island_from_scan = island_from_scan[k];
    if (scan.island >= map.scans.size())
      throw InvalidArgument("islands[" + std::to_string(k) + "] is " + std::to_string(scan.island) +
                            " of " + std::to_string(map.scans.size()) + " scans");
    if (scan.island >= map.islands.size()) map.islands.resize(scan.island + 1);
    map.islands[scan.island].scans.push_back(k);
  }
  return map;
}

pose_graph::Graph graph_of(const Reconstruction& map, const std::vector<std::int64_t>& ids) {
  if (!ids.empty() && ids.size() != map.scans.size())
    throw InvalidArgument("ids has " + std::to_string(ids.size()) +
                          " entries, expected none or as many as scans, " +
                          std::to_string(map.scans.size()));
  const auto id = [&](std::size_t scan) {
    return ids.empty() ? static_cast<std::int64_t>(scan) : ids[scan];
  };
  pose_graph::Graph graph;
  for (std::size_t k = 0; k < map.scans.size(); ++k)
    if (map.scans[k].placed) graph.nodes.push_back({id(k), map.scans[k].island_from_scan});
  for (const Odometry& odometry : map.odometry) {
    if (!map.scans[odometry.source].placed) continue;
    graph.edges.push_back(edge_of(odometry));
    graph.edges.back().source = id(odometry.source);
    graph.edges.back().target = id(odometry.target);
  }
  for (const Edge& edge : map.edges) {
    if (!edge.accepted || !map.scans[edge.source].placed) continue;
    pose_graph::Edge out;
    out.source = id(edge.source);
    out.target = id(edge.target);
    out.target_from_source = edge.target_from_source;
    out.information = edge.information;
    out.confidence = edge.confidence;
    graph.edges.push_back(out);
  }
  return graph;
}

}  // namespace gpureg::reconstruction
