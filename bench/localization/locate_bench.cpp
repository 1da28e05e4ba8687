// SPDX-License-Identifier: BSD-3-Clause
// Time of locate() in a process that goes on, as in a SLAM system:
//   gpureg_locate_bench cpu|cuda MAP SCAN...
// MAP: a file of `gpureg locate --save-map`. SCAN: clouds in the frames of their sensors. Prints
// seconds as JSON: of loading, of the first call, which prepares the map for the search, of one
// scan alone and of one scan in a batch of all.
#include <algorithm>
#include <chrono>
#include <cstdio>
#include <string>
#include <vector>

#include "gpureg/io.hpp"
#include "gpureg/localization.hpp"

namespace {

using gpureg::localization::LocateOptions;
using gpureg::localization::PreparedMap;
using Clock = std::chrono::steady_clock;

constexpr int kRepetitions = 3;

template <typename Work>
double seconds_of(const Work& work) {
  const auto begin = Clock::now();
  work();
  return std::chrono::duration<double>(Clock::now() - begin).count();
}

double median_of(std::vector<double> values) {
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

void run(const gpureg::Context& context, const std::string& file,
         const std::vector<std::string>& names) {
  PreparedMap map;
  const double load = seconds_of([&] { map = PreparedMap::load(file); });
  const LocateOptions options =
      LocateOptions{gpureg::RegistrationOptions{map.options().voxel_size}};
  const Eigen::Vector3f sensor = Eigen::Vector3f::Zero();
  std::vector<gpureg::PointCloud> clouds;
  std::vector<gpureg::PointCloudView> scans;
  for (const std::string& name : names) clouds.push_back(gpureg::io::read_point_cloud(name));
  for (const gpureg::PointCloud& cloud : clouds) {
    scans.push_back(cloud.view());
    scans.back().viewpoints = sensor.data();
    scans.back().viewpoint_count = 1;
  }
  const auto locate = [&](const std::vector<gpureg::PointCloudView>& some) {
    return seconds_of([&] { gpureg::localization::locate(context, some, map, options); });
  };
  const double first = locate({scans.front()});
  std::vector<double> alone, batch;
  for (int k = 0; k < kRepetitions; ++k) {
    for (const gpureg::PointCloudView& scan : scans) alone.push_back(locate({scan}));
    batch.push_back(locate(scans) / static_cast<double>(scans.size()));
  }
  const auto [least, most] = std::minmax_element(alone.begin(), alone.end());
  std::printf(
      "{\"points\": %zu, \"load_seconds\": %.3f, \"first_seconds\": %.4f, \"alone_seconds\": %.4f, "
      "\"alone_range\": [%.4f, %.4f], \"batch_seconds\": %.4f}\n",
      map.size(), load, first, median_of(alone), *least, *most, median_of(batch));
}

}  // namespace

int main(int argc, char** argv) {
  const std::string backend = argc > 1 ? argv[1] : "";
  if (argc < 4 || (backend != "cpu" && backend != "cuda")) {
    std::fprintf(stderr, "usage: %s cpu|cuda MAP SCAN...\n", argv[0]);
    return 2;
  }
  try {
    run(backend == "cpu" ? gpureg::Context::cpu() : gpureg::Context::cuda(), argv[2],
        {argv + 3, argv + argc});
  } catch (const std::exception& error) {
    std::fprintf(stderr, "error: %s\n", error.what());
    return 1;
  }
}
