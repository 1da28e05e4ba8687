// SPDX-License-Identifier: BSD-3-Clause
#include "fragments.hpp"

#include <cstdlib>
#include <map>
#include <memory>

#include "gpureg/error.hpp"
#include "gpureg/io.hpp"

namespace gpureg::bench {

const std::vector<PointCloud>& fragments() {
  static const std::vector<PointCloud> clouds = [] {
    const char* scene = std::getenv("GPUREG_BENCH_SCENE");
    const char* data = std::getenv("GPUREG_DATA_DIR");
    std::vector<PointCloud> out;
    if (!scene && !data) return out;
    for (const auto& [number, file] : io::list_fragments(scene ? scene : std::string(data) + "/redkitchen/fragments"))
      out.push_back(io::read_point_cloud(file));
    return out;
  }();
  return clouds;
}

std::vector<PointCloudView> views() {
  std::vector<PointCloudView> out;
  for (const PointCloud& cloud : fragments()) out.push_back(cloud.view());
  return out;
}

std::vector<Pair> all_pairs() {
  std::vector<Pair> out;
  for (std::uint32_t i = 0; i < fragments().size(); ++i)
    for (std::uint32_t j = i + 1; j < fragments().size(); ++j) out.push_back({j, i});
  return out;
}

const Context* context(benchmark::State& state, const std::string& backend) {
  static std::map<std::string, std::unique_ptr<Context>> contexts;
  if (fragments().size() < 2) {
    state.SkipWithError("no scene: set GPUREG_DATA_DIR or GPUREG_BENCH_SCENE");
    return nullptr;
  }
  auto& found = contexts[backend];
  try {
    if (!found) found = std::make_unique<Context>(backend == "cpu" ? Context::cpu() : Context::cuda());
  } catch (const BackendUnavailable& error) {
    state.SkipWithError(error.what());
    return nullptr;
  }
  return found.get();
}

}  // namespace gpureg::bench
