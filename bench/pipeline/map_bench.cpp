// SPDX-License-Identifier: BSD-3-Clause
// Large maps: time and memory to prepare a building of so many points, and to find the place of one
// room's scan in it.
//   gpureg_map_bench cpu|cuda [--viewpoints] [prepared points ...]
// 1,000,000, 4,000,000 and 16,000,000 points by default. --viewpoints: one of each room is given.
#include <sys/resource.h>

#include <Eigen/Geometry>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <random>
#include <string>
#include <vector>

#include "gpureg/registration.hpp"

namespace {

using Points = std::vector<Eigen::Vector3f>;
using Clock = std::chrono::steady_clock;

constexpr float kVoxel = 0.05f;
/// Raw points per square metre: three for each voxel of a surface.
constexpr float kDensity = 3 / (kVoxel * kVoxel);
/// Prepared points of a room, about.
constexpr double kPointsPerRoom = 47'000;
constexpr float kWidth = 6, kDepth = 5, kHeight = 3;

double seconds_since(Clock::time_point begin) {
  return std::chrono::duration<double>(Clock::now() - begin).count();
}

/// Rooms side by side, each with boxes of its own, one storey.
class Building {
 public:
  explicit Building(int rooms) : side_(std::max(1, static_cast<int>(std::sqrt(rooms)))) {}

  /// Above the furniture.
  Eigen::Vector3f viewpoint(int room) const {
    return corner(room) + Eigen::Vector3f(3, 2.5f, 2.4f);
  }

  /// Points of one room, the same surfaces for every seed.
  void scan(int room, std::uint32_t seed, Points& out) const {
    std::mt19937 shape(static_cast<std::uint32_t>(room) + 1), random(seed);
    std::uniform_real_distribution<float> unit;
    std::normal_distribution<float> noise(0, 0.003f);
    const Eigen::Vector3f at = corner(room);
    const auto add = [&](const Eigen::Vector3f& from, const Eigen::Vector3f& x,
                         const Eigen::Vector3f& y) {
      const auto count = static_cast<int>(kDensity * x.cross(y).norm());
      for (int k = 0; k < count; ++k)
        out.push_back(at + from + unit(random) * x + unit(random) * y +
                      Eigen::Vector3f(noise(random), noise(random), noise(random)));
    };
    add({0, 0, 0}, {kWidth, 0, 0}, {0, kDepth, 0});
    add({0, 0, 0}, {kWidth, 0, 0}, {0, 0, kHeight});
    add({0, 0, 0}, {0, kDepth, 0}, {0, 0, kHeight});
    for (int k = 0; k < 12; ++k) {
      const float turn = 3 * unit(shape);
      const Eigen::Vector3f from(1 + 4 * unit(shape), 1 + 3 * unit(shape), 0),
          x = Eigen::Vector3f(std::cos(turn), std::sin(turn), 0) * (0.3f + unit(shape)),
          y = Eigen::Vector3f(-std::sin(turn), std::cos(turn), 0) * (0.3f + 0.6f * unit(shape)),
          z(0, 0, 0.3f + 1.5f * unit(shape));
      add(from, x, z);
      add(from + y, x, z);
      add(from, y, z);
      add(from + x, y, z);
      add(from + z, x, y);
    }
  }

 private:
  Eigen::Vector3f corner(int room) const {
    return {kWidth * static_cast<float>(room % side_), kDepth * static_cast<float>(room / side_),
            0};
  }

  int side_;
};

double peak_gib() {
  rusage usage{};
  getrusage(RUSAGE_SELF, &usage);
  return static_cast<double>(usage.ru_maxrss) / (1 << 20);
}

gpureg::PointCloudView view_of(const Points& points, const Points& viewpoints) {
  gpureg::PointCloudView view(points);
  if (!viewpoints.empty()) view.viewpoints = viewpoints[0].data();
  view.viewpoint_count = viewpoints.size();
  return view;
}

void run(const gpureg::Context& context, std::size_t wanted, bool with_viewpoints) {
  const int rooms = std::max(1, static_cast<int>(static_cast<double>(wanted) / kPointsPerRoom));
  const Building building(rooms);
  Points map, scan, map_viewpoints, scan_viewpoints;
  for (int room = 0; room < rooms; ++room) building.scan(room, 7, map);
  building.scan(rooms / 2, 8, scan);
  Eigen::Isometry3f motion = Eigen::Isometry3f::Identity();
  motion.rotate(Eigen::AngleAxisf(1.1f, Eigen::Vector3f(0.2f, -0.3f, 1).normalized()));
  motion.pretranslate(Eigen::Vector3f(3, -8, 1));
  for (Eigen::Vector3f& p : scan) p = motion * p;
  if (with_viewpoints) {
    for (int room = 0; room < rooms; ++room) map_viewpoints.push_back(building.viewpoint(room));
    scan_viewpoints.push_back(motion * building.viewpoint(rooms / 2));
  }
  const auto options = gpureg::RegistrationOptions{kVoxel};

  auto begin = Clock::now();
  const auto target = gpureg::prepare(context, view_of(map, map_viewpoints), options);
  const double prepared = seconds_since(begin);
  const auto source = gpureg::prepare(context, view_of(scan, scan_viewpoints), options);
  begin = Clock::now();
  const auto result = gpureg::align(context, source, target, options);
  const double aligned = seconds_since(begin);
  const Eigen::Isometry3d truth = motion.cast<double>().inverse();
  const Eigen::Vector3d middle = scan[scan.size() / 2].cast<double>();
  std::printf(
      "{\"raw_points\": %zu, \"viewpoints\": %zu, \"points\": %zu, \"prepare_s\": %.2f, "
      "\"align_s\": %.2f, "
      "\"match_ms\": %.1f, \"confidence\": %.3f, \"error_m\": %.3f, \"host_gib\": %.1f",
      map.size(), map_viewpoints.size(), static_cast<std::size_t>(target.size()), prepared, aligned,
      result.timings.match, result.confidence,
      (result.target_from_source * middle - truth * middle).norm(), peak_gib());
  const gpureg::PrepareStatistics& stages = target.statistics();
  std::printf(
      ", \"prepare_ms\": {\"downsample\": %.1f, \"normals\": %.1f, \"features\": %.1f, "
      "\"grid\": %.1f, \"depth_maps\": %.1f, \"surface_sides\": %.1f}",
      stages.downsample, stages.normals, stages.features, stages.grid, stages.depth_maps,
      stages.surface_sides);
  for (const gpureg::DeviceMemoryUse& use : context.device_memory())
    std::printf(", \"device_in_use_gib\": %.1f, \"device_reserved_gib\": %.1f",
                static_cast<double>(use.bytes_in_use) / (1 << 30),
                static_cast<double>(use.bytes_reserved) / (1 << 30));
  std::printf("}\n");
  std::fflush(stdout);
}

}  // namespace

int main(int argc, char** argv) {
  const std::string backend = argc > 1 ? argv[1] : "";
  if (backend != "cpu" && backend != "cuda") {
    std::fprintf(stderr, "usage: %s cpu|cuda [--viewpoints] [prepared points ...]\n", argv[0]);
    return 2;
  }
  bool viewpoints = false;
  std::vector<std::size_t> sizes;
  for (int k = 2; k < argc; ++k)
    if (argv[k] == std::string("--viewpoints"))
      viewpoints = true;
    else
      sizes.push_back(std::strtoull(argv[k], nullptr, 10));
  if (sizes.empty()) sizes = {1'000'000, 4'000'000, 16'000'000};
  try {
    const auto context = backend == "cpu" ? gpureg::Context::cpu() : gpureg::Context::cuda();
    for (const std::size_t size : sizes) {
      run(context, size, viewpoints);
      context.trim();
    }
  } catch (const std::exception& error) {
    std::fprintf(stderr, "error: %s\n", error.what());
    return 1;
  }
}
