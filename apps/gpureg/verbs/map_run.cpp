// SPDX-License-Identifier: BSD-3-Clause
#include "verbs/map_run.hpp"

#include <algorithm>
#include <filesystem>

namespace gpureg::cli {

std::string MapRun::file(const std::string& name) const {
  return (std::filesystem::path(output) / name).string();
}

bool MapRun::has(int number) const {
  return std::binary_search(scene.numbers.begin(), scene.numbers.end(), number);
}

std::uint32_t MapRun::index_of(int number) const {
  const auto at = std::lower_bound(scene.numbers.begin(), scene.numbers.end(), number);
  return static_cast<std::uint32_t>(at - scene.numbers.begin());
}

std::size_t MapRun::accepted_edges() const {
  return static_cast<std::size_t>(
      std::count_if(map.edges.begin(), map.edges.end(),
                    [](const reconstruction::Edge& edge) { return edge.accepted; }));
}

}  // namespace gpureg::cli
