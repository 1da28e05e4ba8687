// SPDX-License-Identifier: BSD-3-Clause
#include "data/generate.hpp"

#include <algorithm>
#include <atomic>
#include <cmath>
#include <exception>
#include <mutex>
#include <thread>
#include <vector>

#include "data/furniture/scatter.hpp"
#include "data/ground_truth.hpp"
#include "data/random.hpp"
#include "data/rooms/building_file.hpp"
#include "data/rooms/building_texture.hpp"
#include "data/rooms/house.hpp"
#include "data/scene_files.hpp"
#include "data/sensor/depth_sensor.hpp"
#include "data/sensor/fusion.hpp"
#include "data/sensor/planar_scanner.hpp"
#include "data/sensor/rgbd.hpp"
#include "data/surface.hpp"
#include "data/tours/trajectory.hpp"
#include "gpureg/error.hpp"

namespace gpureg::synthetic {
namespace {

constexpr float kPointSpacing = 0.02f;  // metres: cells in which zero crossings are averaged
constexpr int kSurfaceStep = 5;         // of so many frames one looks for true surfaces

void require(bool fine, const std::string& field, const std::string& value, const char* rule) {
  if (!fine) throw InvalidArgument(field + " is " + value + ", but must be " + rule);
}

bool is_generated(const std::string& building) {
  return building.empty() || building == "office" || building == "warehouse";
}

void validate(const GenerateOptions& o) {
  require(o.fragments >= 1 && o.fragments <= 10000, "fragments", std::to_string(o.fragments),
          "1 to 10000");
  require(o.frames_per_fragment >= 1 && o.frames_per_fragment <= 1000, "frames_per_fragment",
          std::to_string(o.frames_per_fragment), "1 to 1000");
  require(o.threads >= 0 && o.threads <= 1024, "threads", std::to_string(o.threads),
          "0 (all cores) to 1024");
  require(o.clutter >= 0 && o.clutter <= 2, "clutter", std::to_string(o.clutter),
          "0 to 2 a square metre");
  require(o.clutter == 0 || !is_generated(o.building), "clutter", std::to_string(o.clutter),
          "0 without a mesh of a building: generated ones are furnished");
  require(o.rearrangement == 0 || o.building.empty(), "rearrangement",
          std::to_string(o.rearrangement), "0 with a building: only houses are rearranged");
  require(o.no_return >= 0 && o.no_return <= 1000, "no_return", std::to_string(o.no_return),
          "0 to 1000 m");
  const SensorOptions& s = o.sensor;
  const auto in = [&](const char* name, double value, double low, double high, const char* rule) {
    require(value >= low && value <= high, std::string("sensor.") + name, std::to_string(value),
            rule);  // NaN fails too
  };
  in("min_depth", s.min_depth, 0.05, 10, "0.05 to 10 m");
  in("max_depth", s.max_depth, 0.1, 13, "0.1 to 13 m");  // 16 bits of 1/5000 m end at 13.1 m
  require(s.max_depth > s.min_depth, "sensor.max_depth", std::to_string(s.max_depth),
          "greater than sensor.min_depth");
  in("pixel_shift", s.pixel_shift, 0, 10, "0 to 10 pixels");
  in("disparity_noise", s.disparity_noise, 0, 10, "0 to 10 steps");
  in("distortion", s.distortion, 0, 0.1, "0 to 0.1");
  in("odometry_translation", s.odometry_translation, 0, 0.1, "0 to 0.1 m");
  in("odometry_rotation_degrees", s.odometry_rotation_degrees, 0, 10, "0 to 10 degrees");
  const PlanarScannerOptions& p = o.scanner;
  if (p.step == 0) return;
  require(!o.rgbd, "rgbd", "true", "false with a 2-D scanner: it has no images");
  const auto of_scanner = [&](const char* name, double value, double low, double high,
                              const char* rule) {
    require(value >= low && value <= high, std::string("scanner.") + name, std::to_string(value),
            rule);
  };
  of_scanner("step", p.step, 0.05, 5, "0.05 to 5 degrees");
  of_scanner("field", p.field, 30, 360, "30 to 360 degrees");
  of_scanner("range", p.range, 1, 100, "1 to 100 m");
  of_scanner("noise", p.noise, 0, 1, "0 to 1 m");
}

/// Runs work(0) .. work(count - 1) on the threads; the first exception ends all and is thrown here.
template <class Work>
void parallel(int threads, int count, const Work& work) {
  std::atomic<int> next{0};
  std::exception_ptr failure;
  std::mutex guard;
  const auto worker = [&] {
    try {
      for (int i; (i = next.fetch_add(1)) < count;) work(i);
    } catch (...) {
      next = count;
      const std::lock_guard<std::mutex> lock(guard);
      if (!failure) failure = std::current_exception();
    }
  };
  std::vector<std::thread> pool;
  for (int t = 1; t < std::min(threads, count); ++t) pool.emplace_back(worker);
  worker();
  for (std::thread& thread : pool) thread.join();
  if (failure) std::rethrow_exception(failure);
}

/// Of path and noise.
std::uint64_t visit_seed(const GenerateOptions& options) {
  return options.rearrangement == 0
             ? options.seed
             : hash_key(options.seed, Purpose::rearrangement, options.rearrangement);
}

House building_of(const GenerateOptions& options) {
  if (options.building.empty()) return build_house(options.seed, options.rearrangement);
  if (options.building == "office") return build_office(options.seed);
  if (options.building == "warehouse") return build_warehouse(options.seed);
  House house{{}, {}, {}, read_building(options.building)};
  texture_building(house.mesh, options.seed);
  scatter(house, options.seed, options.clutter);
  return house;
}

/// One scene on its way into a folder.
class Generator {
 public:
  Generator(const std::string& folder, const GenerateOptions& options, const Progress& progress)
      : folder_(folder),
        options_(options),
        progress_(progress),
        threads_(options.threads > 0
                     ? options.threads
                     : std::max(1, static_cast<int>(std::thread::hardware_concurrency()))),
        house_(building_of(options)),
        scene_(house_.mesh),
        sensor_(scene_, options.sensor, visit_seed(options)),
        scanner_(scene_, options.scanner, visit_seed(options)),
        world_from_camera_(walk(house_, scene_, visit_seed(options),
                                options.fragments * options.frames_per_fragment,
                                static_cast<float>(options.no_return))),
        fragments_(static_cast<std::size_t>(options.fragments)),
        cameras_(fragments_.size()),
        surfaces_(fragments_.size()) {}

  void run() {
    open_folder(folder_, options_.fragments, options_.rgbd);
    report(0, options_.fragments, "fragments");
    parallel(threads_, options_.fragments, [&](int i) { scan(i); });
    if (stopped()) return;
    const std::vector<PairTruth> truths = compare_all();
    if (stopped()) return;
    std::vector<Eigen::Isometry3d> poses;
    for (const Fragment& fragment : fragments_) poses.push_back(fragment.world_from_fragment);
    if (options_.rgbd) {
      write_sequence_lists(folder_, world_from_camera_);
      write_depth_calibration(folder_, sensor_);
      write_surface(folder_ + "/surface.ply", surfaces_);
    }
    write_poses(folder_ + "/poses.txt", poses);
    write_cameras(folder_ + "/cameras.txt", cameras_);
    write_ground_truth(folder_, options_.fragments, truths);
  }

 private:
  bool stopped() {
    if (!stop_ && progress_.should_stop && progress_.should_stop()) stop_ = true;
    return stop_;
  }

  void report(int done, int total, const char* stage) {
    if (progress_.report) progress_.report(done, total, stage);
  }
  void step(int total, const char* stage) {
    const std::lock_guard<std::mutex> lock(report_guard_);
    report(++done_, total, stage);
  }

  /// Poses of a fragment's cameras by the odometry: the true motion plus an error that
  /// adds up frame by frame.
  std::vector<Eigen::Isometry3d> odometry(int first) const {
    std::vector<Eigen::Isometry3d> estimate(1, Eigen::Isometry3d::Identity());
    for (int frame = first + 1; frame < first + options_.frames_per_fragment; ++frame) {
      Random random(
          hash_key(visit_seed(options_), Purpose::drift, static_cast<std::uint64_t>(frame)));
      Eigen::Vector3d turn, shift;
      for (int axis = 0; axis < 3; ++axis) {
        turn[axis] =
            options_.sensor.odometry_rotation_degrees * 0.017453292519943295 * random.normal();
        shift[axis] = options_.sensor.odometry_translation * random.normal();
      }
      const double angle = turn.norm();
      Eigen::Isometry3d error = Eigen::Isometry3d::Identity();
      if (angle > 0) error.linear() = Eigen::AngleAxisd(angle, turn / angle).toRotationMatrix();
      error.translation() = shift;
      const auto k = static_cast<std::size_t>(frame);
      estimate.push_back(estimate.back() *
                         (world_from_camera_[k - 1].inverse() * world_from_camera_[k]) * error);
    }
    return estimate;
  }

  void scan(int i) {
    const int first = i * options_.frames_per_fragment;
    const auto at = static_cast<std::size_t>(i);
    if (options_.scanner.step > 0) return scan_plane(i, first);
    fragments_[at].world_from_fragment = world_from_camera_[static_cast<std::size_t>(first)];
    cameras_[at] = odometry(first);
    FusionVolume volume;
    for (int k = 0; k < options_.frames_per_fragment; ++k) {
      if (stopped()) return;
      const Eigen::Isometry3d& pose = world_from_camera_[static_cast<std::size_t>(first + k)];
      const DepthQuarter quarter = sensor_.capture(pose, first + k, 0, 0);
      volume.integrate(quarter, cameras_[at][static_cast<std::size_t>(k)]);
      if (!options_.rgbd) continue;
      if (k % kSurfaceStep == 0)
        surfaces_[at].look(scene_, pose, options_.sensor.min_depth, options_.sensor.max_depth);
      write_frame(folder_, first + k, render_colour(scene_, pose, options_.seed, first + k),
                  depth_image({quarter, sensor_.capture(pose, first + k, 1, 0),
                               sensor_.capture(pose, first + k, 0, 1),
                               sensor_.capture(pose, first + k, 1, 1)}));
    }
    // A surface counts when it was seen a few times, at least from afar; short fragments must do
    // with less.
    const float sightings =
        std::clamp(static_cast<float>(options_.frames_per_fragment) / 15.0f, 0.5f, 3.0f);
    const float farthest = static_cast<float>(options_.sensor.max_depth);
    fragments_[at].points = volume.extract(sightings / (farthest * farthest), kPointSpacing);
    finish(i);
  }

  void scan_plane(int i, int frame) {
    Fragment& fragment = fragments_[static_cast<std::size_t>(i)];
    fragment.world_from_fragment =
        scanner_.pose_under(world_from_camera_[static_cast<std::size_t>(frame)]);
    fragment.points = scanner_.scan(fragment.world_from_fragment, frame);
    cameras_[static_cast<std::size_t>(i)] = {Eigen::Isometry3d::Identity()};
    finish(i);
  }

  void finish(int i) {
    write_cloud(folder_ + "/cloud_bin_" + std::to_string(i) + ".ply",
                fragments_[static_cast<std::size_t>(i)].points);
    step(options_.fragments, "fragments");
  }

  /// All pairs i < j, in order. A row of pairs is one piece of work.
  std::vector<PairTruth> compare_all() {
    done_ = 0;
    report(0, options_.fragments, "ground truth");
    std::vector<NeighbourGrid> grids;
    grids.reserve(fragments_.size());
    for (const Fragment& fragment : fragments_) {
      if (stopped()) return {};
      grids.emplace_back(fragment.points, kOverlapRadius);
    }
    std::vector<std::vector<PairTruth>> rows(fragments_.size());
    parallel(threads_, options_.fragments, [&](int i) {
      if (stopped()) return;
      for (int j = i + 1; j < options_.fragments; ++j)
        rows[static_cast<std::size_t>(i)].push_back(pair_truth(fragments_, grids, i, j));
      step(options_.fragments, "ground truth");
    });
    std::vector<PairTruth> all;
    for (const auto& row : rows) all.insert(all.end(), row.begin(), row.end());
    return all;
  }

  const std::string& folder_;
  const GenerateOptions& options_;
  const Progress& progress_;
  const int threads_;
  const House house_;
  const RayScene scene_;
  const DepthSensor sensor_;
  const PlanarScanner scanner_;
  const std::vector<Eigen::Isometry3d> world_from_camera_;
  std::vector<Fragment> fragments_;
  std::vector<std::vector<Eigen::Isometry3d>> cameras_;  // fragment_from_camera
  std::vector<VisibleSurface> surfaces_;                 // empty without rgbd
  std::atomic<bool> stop_{false};
  std::mutex report_guard_;
  int done_ = 0;
};

}  // namespace

void generate(const std::string& out_folder, const GenerateOptions& options,
              const Progress& progress) {
  validate(options);
  Generator(out_folder, options, progress).run();
}

}  // namespace gpureg::synthetic
