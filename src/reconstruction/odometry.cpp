// SPDX-License-Identifier: BSD-3-Clause
#include "reconstruction/odometry.hpp"

#include <algorithm>
#include <map>
#include <string>

#include "gpureg/error.hpp"
#include "pose_graph/problem.hpp"

namespace gpureg::reconstruction {

std::vector<Odometry> checked_odometry(std::size_t scans, std::vector<Odometry> odometry,
                                       const pose_graph::DriftOptions& drift) {
  for (std::size_t k = 0; k < odometry.size(); ++k) {
    Odometry& edge = odometry[k];
    const std::string where = "odometry[" + std::to_string(k) + "]";
    const std::uint32_t largest = std::max(edge.source, edge.target);
    if (largest >= scans)
      throw InvalidArgument(where + " names scan " + std::to_string(largest) + " of " +
                            std::to_string(scans));
    if (edge.source == edge.target) throw InvalidArgument(where + " is a scan with itself");
    if (!(edge.confidence > 0 && edge.confidence <= 1))
      throw InvalidArgument(where + ".confidence is " + std::to_string(edge.confidence) +
                            ", expected (0, 1]");
    pose_graph::Graph alone;
    alone.nodes = {{edge.source}, {edge.target}};
    alone.edges = {edge_of(edge)};
    try {
      alone.validate();
    } catch (const InvalidArgument& error) {
      throw InvalidArgument(where + ": " + error.what());
    }
    if (!edge.information)
      edge.information = pose_graph::odometry_information(
          {edge.target_from_source.linear(), edge.target_from_source.translation()}, drift);
  }
  return odometry;
}

std::vector<Odometry> odometry_of_poses(const std::vector<UnalignedIsometry3d>& world_from_scan) {
  std::vector<Odometry> out;
  const UnalignedIsometry3d* before = nullptr;
  for (std::size_t k = 0; k < world_from_scan.size(); ++k) {
    if (!world_from_scan[k].matrix().allFinite()) continue;
    if (before != nullptr) {
      Odometry edge;
      edge.source = static_cast<std::uint32_t>(k);
      edge.target = static_cast<std::uint32_t>(before - world_from_scan.data());
      edge.target_from_source = before->inverse() * world_from_scan[k];
      out.push_back(edge);
    }
    before = &world_from_scan[k];
  }
  return out;
}

pose_graph::Edge edge_of(const Odometry& odometry) {
  pose_graph::Edge edge;
  edge.source = odometry.source;
  edge.target = odometry.target;
  edge.target_from_source = odometry.target_from_source;
  edge.information = odometry.information;
  edge.kind = pose_graph::EdgeKind::odometry;
  return edge;
}

Odometry odometry_of(std::uint32_t source, std::uint32_t target,
                     const UnalignedIsometry3d& target_from_source, double shift, double turn) {
  Odometry out;
  out.source = source;
  out.target = target;
  out.target_from_source = target_from_source;
  out.information = pose_graph::UnalignedMatrix6d::Identity();
  out.information->diagonal().head<3>() /= turn * turn;
  out.information->diagonal().tail<3>() /= shift * shift;
  return out;
}

std::vector<Odometry> chains_of(const std::vector<UnalignedIsometry3d>& poses,
                                const std::vector<std::uint32_t>& parts, double shift,
                                double turn) {
  std::map<std::uint32_t, std::uint32_t> last;
  std::vector<Odometry> out;
  for (std::uint32_t k = 0; k < parts.size(); ++k) {
    if (parts[k] == 0xffffffffu) continue;
    const auto [at, first] = last.insert({parts[k], k});
    if (!first)
      out.push_back(
          odometry_of(k, at->second, poses[at->second].inverse() * poses[k], shift, turn));
    at->second = k;
  }
  return out;
}

}  // namespace gpureg::reconstruction
