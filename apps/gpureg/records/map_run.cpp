// SPDX-License-Identifier: BSD-3-Clause
#include "records/map_run.hpp"

#include <algorithm>
#include <filesystem>

namespace gpureg::cli {

std::string MapRun::file(const std::string& name) const {
  return (std::filesystem::path(output) / name).string();
}

std::size_t MapRun::accepted_edges() const {
  return static_cast<std::size_t>(
      std::count_if(made.map.edges.begin(), made.map.edges.end(),
                    [](const reconstruction::Edge& edge) { return edge.accepted; }));
}

Eigen::Matrix4d MapRun::island_from_scan(std::size_t scan) const {
  Eigen::Matrix4d out = made.map.scans[scan].island_from_scan.matrix();
  out.topLeftCorner<3, 3>() *= scale(scan);
  return out;
}

Eigen::Matrix4d MapRun::of_files(std::size_t source, std::size_t target,
                                 const UnalignedIsometry3d& target_from_source) const {
  Eigen::Matrix4d out = target_from_source.matrix();
  out.topLeftCorner<3, 3>() *= scale(source);
  out.topRows<3>() /= scale(target);
  return out;
}

}  // namespace gpureg::cli
