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

}  // namespace gpureg::cli
