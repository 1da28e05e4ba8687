// SPDX-License-Identifier: BSD-3-Clause
#include "fragments.hpp"

#include <algorithm>
#include <cstdlib>
#include <fstream>
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
    const std::string folder = scene ? scene : std::string(data) + "/redkitchen/fragments",
                      cameras = folder + "/cameras.txt";
    std::map<int, std::vector<Eigen::Vector3d>> viewpoints;
    if (std::ifstream(cameras)) viewpoints = io::read_cameras(cameras);
    for (const io::ScanFile& scan : io::list_scans(folder)) {
      out.push_back(io::read_point_cloud(scan.path));
      if (viewpoints.count(scan.number) > 0) out.back().set_viewpoints(viewpoints[scan.number]);
    }
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

void report(benchmark::State& state, const std::vector<RegistrationResult>& results,
            std::size_t runs) {
  StageTimings sum;
  double survivors = 0, aligned = 0, points = 0;
  for (const RegistrationResult& r : results) {
    sum.match += r.timings.match;
    sum.propose += r.timings.propose;
    sum.rank += r.timings.rank;
    sum.refine += r.timings.refine;
    sum.verify += r.timings.verify;
    survivors += static_cast<double>(r.statistics.survivors);
    aligned += r.aligned();
    points += r.statistics.source_points;
  }
  const double n = static_cast<double>(results.size());
  state.counters["pairs"] = n;
  state.counters["aligned"] = aligned;
  state.counters["points"] = points / n;
  state.counters["survivors"] = survivors / n;
  state.counters["ms_match"] = sum.match / n;
  state.counters["ms_propose"] = sum.propose / n;
  state.counters["ms_rank"] = sum.rank / n;
  state.counters["ms_refine"] = sum.refine / n;
  state.counters["ms_verify"] = sum.verify / n;
  state.counters["ms_per_pair"] =
      benchmark::Counter(n * static_cast<double>(runs) * 1e-3,
                         benchmark::Counter::kIsRate | benchmark::Counter::kInvert);
}

void report_memory(benchmark::State& state, const Context& context) {
  double most = 0;
  for (const DeviceMemoryUse& use : context.device_memory())
    most = std::max(most, static_cast<double>(use.bytes_reserved));
  state.counters["devices"] = static_cast<double>(context.device_memory().size());
  state.counters["GiB_per_device"] = most / (1 << 30);
}

Context new_context(const std::string& backend) {
  if (backend == "cpu") return Context::cpu();
  CudaOptions options;
  if (backend == "cuda_all") options.devices.clear();
  return Context::cuda(options);
}

const Context* context(benchmark::State& state, const std::string& backend) {
  static std::map<std::string, std::unique_ptr<Context>> contexts;
  if (fragments().size() < 2) {
    state.SkipWithError("no scene: set GPUREG_DATA_DIR or GPUREG_BENCH_SCENE");
    return nullptr;
  }
  auto& found = contexts[backend];
  try {
    if (!found) found = std::make_unique<Context>(new_context(backend));
  } catch (const BackendUnavailable& error) {
    state.SkipWithError(error.what());
    return nullptr;
  }
  return found.get();
}

}  // namespace gpureg::bench
