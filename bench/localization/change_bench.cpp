// SPDX-License-Identifier: BSD-3-Clause
// Scans of a rearranged house compared with a map of it as it was:
//   gpureg generate MAP --seed S --fragments 24
//   gpureg generate SCANS --seed S --rearrange R --fragments 10
//   gpureg_change_bench S R MAP SCANS
// prints precision and recall of the labels "new" and "gone" over the points whose truth is clear.
#include <array>
#include <cstdio>
#include <fstream>
#include <iostream>

#include "change_truth.hpp"
#include "data/random.hpp"
#include "gpureg/change.hpp"
#include "gpureg/error.hpp"
#include "gpureg/io.hpp"

namespace gpureg::bench {
namespace {

using localization::ChangeLabel;
using localization::ChangeResult;
using localization::MapBuilder;
using localization::MapOptions;
using localization::PreparedMap;

constexpr float kVoxel = 0.05f;
constexpr float kRecorded = 0.05f;  // a point that near to a seen surface is one of it
constexpr int kCameraStep = 3;      // of so many cameras one is asked whether it saw through

struct Visit {
  std::vector<PointCloud> clouds;
  std::vector<Eigen::Isometry3d> world_from_cloud;
  std::vector<Cameras> cameras;  // world_from_camera of each cloud
};

Visit read_visit(const std::string& folder) {
  Visit visit;
  std::ifstream poses(folder + "/poses.txt");
  for (int number; poses >> number;) {
    Eigen::Matrix4d pose;
    for (int row = 0; row < 4; ++row)
      for (int column = 0; column < 4; ++column) poses >> pose(row, column);
    visit.world_from_cloud.emplace_back(Eigen::Isometry3d(pose));
    visit.clouds.push_back(
        io::read_point_cloud(folder + "/cloud_bin_" + std::to_string(number) + ".ply"));
    visit.clouds.back().set_viewpoints(io::read_cameras(folder + "/cameras.txt").at(number));
  }
  visit.cameras.resize(visit.clouds.size());
  std::ifstream cameras(folder + "/cameras.txt");
  int fragment = 0, frame = 0;
  for (std::array<double, 7> v{}; cameras >> fragment >> frame;) {
    for (double& x : v) cameras >> x;
    if (frame % kCameraStep != 0) continue;
    Eigen::Isometry3d pose(Eigen::Quaterniond(v[6], v[3], v[4], v[5]));
    pose.translation() = Eigen::Vector3d(v[0], v[1], v[2]);
    const auto k = static_cast<std::size_t>(fragment);
    visit.cameras.at(k).push_back(visit.world_from_cloud.at(k) * pose);
  }
  if (visit.clouds.empty()) throw IoError(folder + ": no poses.txt");
  return visit;
}

/// Counts over points whose truth is clear; probabilities by tenths.
struct Score {
  std::size_t points = 0, changed = 0, right = 0, wrong = 0, missed = 0;
  std::array<std::size_t, 10> said{}, held{};
  std::array<std::size_t, 5> labels{};  // of the changed points

  void add(ChangeLabel label, float probability, bool is_changed, TrueHouse::Surface truth,
           bool observed) {
    ++points;
    if (truth == TrueHouse::Surface::near) return;
    const bool truly = truth == TrueHouse::Surface::none;
    if (is_changed) {
      (truly ? right : wrong) += 1;
      const auto tenth = std::min<std::size_t>(9, static_cast<std::size_t>(10 * probability));
      ++said[tenth];
      held[tenth] += truly ? 1 : 0;
    }
    if (!truly || !observed) return;
    ++changed;
    missed += is_changed ? 0 : 1;
    ++labels[static_cast<std::size_t>(label)];
  }
  void print(const char* name) const {
    const auto ratio = [](std::size_t a, std::size_t b) {
      return b == 0 ? 1.0 : static_cast<double>(a) / static_cast<double>(b);
    };
    std::printf(
        "{\"label\": \"%s\", \"points\": %zu, \"changed\": %zu, \"precision\": %.4f, "
        "\"recall\": %.4f, \"false_share\": %.4f, \"calibration\": [",
        name, points, changed, ratio(right, right + wrong), ratio(changed - missed, changed),
        ratio(wrong, points));
    for (std::size_t k = 5; k < said.size(); ++k)
      std::printf("%s[%zu, %.3f]", k == 5 ? "" : ", ", said[k], ratio(held[k], said[k]));
    std::printf("]");
    for (std::size_t k = 0; k < labels.size(); ++k)
      std::printf(", \"%s\": %zu", to_string(static_cast<ChangeLabel>(k)), labels[k]);
    std::printf("}\n");
    std::fflush(stdout);
  }
};

/// A pose that is known to 2 cm and half a degree.
Eigen::Isometry3d shaken(const Eigen::Isometry3d& pose, std::uint64_t key) {
  synthetic::Random random(key);
  Eigen::Vector3d turn, shift;
  for (int axis = 0; axis < 3; ++axis) {
    turn[axis] = 0.005 * static_cast<double>(random.normal());
    shift[axis] = 0.012 * static_cast<double>(random.normal());
  }
  Eigen::Isometry3d error(Eigen::AngleAxisd(turn.norm(), turn.normalized()));
  error.translation() = shift;
  return pose * error;
}

int run(std::uint64_t seed, std::uint64_t rearrangement, const std::string& map_folder,
        const std::string& scan_folder) {
  const TrueHouse before(synthetic::build_house(seed)),
      after(synthetic::build_house(seed, rearrangement));
  const Visit of_map = read_visit(map_folder), of_scans = read_visit(scan_folder);
  const Context context = Context::cpu();
  MapBuilder builder(MapOptions{kVoxel});
  Cameras map_cameras;
  for (std::size_t k = 0; k < of_map.clouds.size(); ++k) {
    builder.add_scan(context, of_map.clouds[k].view(),
                     UnalignedIsometry3d(of_map.world_from_cloud[k]));
    map_cameras.insert(map_cameras.end(), of_map.cameras[k].begin(), of_map.cameras[k].end());
  }
  const PreparedMap map = builder.build();
  const PointCloud map_cloud = map.cloud();
  std::vector<Eigen::Vector3f> in_world;
  for (const Eigen::Vector3f& p : map_cloud.points)
    in_world.push_back((p.cast<double>() + map_cloud.origin).cast<float>());
  const synthetic::NeighbourGrid map_grid(in_world, kRecorded);
  Score appeared, gone;
  for (std::size_t s = 0; s < of_scans.clouds.size(); ++s) {
    const PointCloud& scan = of_scans.clouds[s];
    const Eigen::Isometry3d& truth = of_scans.world_from_cloud[s];
    const ChangeResult result = localization::find_changes(
        context, scan.view(), map, UnalignedIsometry3d(shaken(truth, seed * 1000 + s)));
    std::fprintf(stderr, "scan %zu: off by %.3f m, inliers %.2f\n", s,
                 (result.map_from_scan.translation() - truth.translation()).norm(),
                 result.inlier_ratio);
    std::vector<Eigen::Vector3f> placed;
    for (const Eigen::Vector3f& p : scan.points)
      placed.push_back((truth * p.cast<double>()).cast<float>());
    const synthetic::NeighbourGrid scan_grid(placed, kRecorded);
    for (std::size_t k = 0; k < placed.size(); k += 4) {
      const Eigen::Vector3f& p = placed[k];
      const auto surface = before.surface_at(p);
      const ChangeLabel label = result.scan.labels[k];
      appeared.add(
          label, result.scan.probabilities[k], label == ChangeLabel::appeared, surface,
          surface == TrueHouse::Surface::none && before.seen_through(p, map_cameras, map_grid));
    }
    for (std::size_t k = 0; k < in_world.size(); ++k) {
      const Eigen::Vector3f& p = in_world[k];
      const auto surface = after.surface_at(p);
      const ChangeLabel label = result.map.labels[k];
      gone.add(label, result.map.probabilities[k], label == ChangeLabel::gone, surface,
               surface == TrueHouse::Surface::none &&
                   after.seen_through(p, of_scans.cameras[s], scan_grid));
    }
  }
  appeared.print("new");
  gone.print("gone");
  return 0;
}

}  // namespace
}  // namespace gpureg::bench

int main(int argc, char** argv) {
  try {
    if (argc != 5) throw gpureg::InvalidArgument("expected SEED REARRANGEMENT MAP SCANS");
    return gpureg::bench::run(std::stoull(argv[1]), std::stoull(argv[2]), argv[3], argv[4]);
  } catch (const std::exception& error) {
    std::cerr << error.what() << std::endl;
    return 2;
  }
}
