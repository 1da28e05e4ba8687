// SPDX-License-Identifier: BSD-3-Clause
#include "depth_calibration.hpp"

#include <gtest/gtest.h>
#include <gpureg/error.hpp>

#include <cmath>
#include <functional>
#include <numeric>
#include <random>
#include <set>

#include "mapping/bundle.hpp"
#include "support/temporary_folder.hpp"

namespace slam_demo {
namespace {

/// Offsets that grow from the left to the right, and a bump.
DepthCalibration field() {
  DepthCalibration c;
  for (int row = 0; row < DepthCalibration::kRows; ++row) {
    for (int column = 0; column < DepthCalibration::kColumns; ++column)
      c.offsets[static_cast<std::size_t>(row * DepthCalibration::kColumns + column)] =
          0.004 * std::sin(0.5 * column - 1.5) + 0.003 * std::cos(0.6 * row);
  }
  return c;
}

TEST(DepthCalibration, IsBilinearBetweenItsNodes) {
  const DepthCalibration c = field();
  EXPECT_EQ(c.offset(0, 0), c.offsets[0]);
  EXPECT_EQ(c.offset(639, 479), c.offsets.back());
  EXPECT_NEAR(c.offset(639.0 / 16, 0), (c.offsets[0] + c.offsets[1]) / 2, 1e-15);
  EXPECT_EQ(c.offset(-5, 500), c.offset(0, 479)) << "outside: that of the edge";
  for (const auto& [u, v] : {std::pair{0.0, 0.0}, std::pair{639.0, 479.0}, std::pair{300.5, 7.0}}) {
    double sum = 0;
    std::set<std::size_t> nodes;
    for (const auto& w : c.around(u, v)) {
      sum += w.share;
      nodes.insert(w.node);
    }
    EXPECT_NEAR(sum, 1, 1e-15);
    EXPECT_EQ(nodes.size(), 4u);
    EXPECT_LT(*nodes.rbegin(), DepthCalibration::kNodes);
  }
}

TEST(DepthCalibration, CorrectsDepthsAndPoints) {
  const DepthCalibration c = field();
  EXPECT_EQ(c.corrected(10, 10, 0), 0) << "no depth stays none";
  const double measured = 1 / (1 / 2.5 + c.offset(100, 200));
  EXPECT_NEAR(c.corrected(100, 200, measured), 2.5, 1e-12);
  cv::Mat1f image(480, 640, 0.0f);
  image(200, 100) = static_cast<float>(measured);
  EXPECT_NEAR(c.corrected(image)(200, 100), 2.5, 1e-6);
  EXPECT_EQ(c.corrected(image)(0, 0), 0);
  EXPECT_EQ(DepthCalibration().corrected(image).data, image.data) << "nothing to do";
  const Pinhole camera;
  const Eigen::Vector3d before = camera.unproject(100, 200, measured),
                        after = c.moved(camera, DepthCalibration(), before);
  EXPECT_LT((after - camera.unproject(100, 200, 2.5)).norm(), 1e-12);
  EXPECT_LT((DepthCalibration().moved(camera, c, after) - before).norm(), 1e-12);
}

TEST(DepthCalibration, FileKeepsEveryBit) {
  const gpureg::test::TemporaryFolder folder;
  DepthCalibration c = field();
  c.width = 320;
  c.lens = {1, 2.5, -3, 0.1, 1e-3, -1.0 / 3};
  write_depth_calibration(folder / "c.json", c);
  const DepthCalibration read = read_depth_calibration(folder / "c.json");
  EXPECT_EQ(read.offsets, c.offsets);
  EXPECT_EQ(read.lens, c.lens);
  EXPECT_EQ(read.width, 320);
  for (const char* bad : {"", "{}", "[1]", R"({"columns": 2, "rows": 2})"}) {
    folder.write("bad.json", bad);
    try {
      read_depth_calibration(folder / "bad.json");
      ADD_FAILURE() << bad;
    } catch (const gpureg::IoError& error) {
      EXPECT_NE(std::string(error.what()).find("bad.json"), std::string::npos);
    }
  }
  EXPECT_THROW(read_depth_calibration(folder / "missing.json"), gpureg::IoError);
}

/// Twelve keyframes that look at points 1 to 4 m away from different places and angles; their
/// depths have the offsets of a camera, its pixels the lens. The map starts from these depths.
struct Scene {
  Pinhole camera;
  Map map;
  std::vector<Eigen::Isometry3d> truth;
  explicit Scene(const DepthCalibration& offsets, const Lens& lens = {}) {
    std::mt19937 random(3);
    const auto uniform = [&](double low, double high) {
      return low + (high - low) * (random() / 4294967296.0);
    };
    std::vector<Eigen::Vector3d> points;
    for (int k = 0; k < 1500; ++k)
      points.emplace_back(uniform(-2.5, 2.5), uniform(-2, 2), uniform(1.5, 4));
    for (int k = 0; k < 12; ++k) {
      Eigen::Isometry3d pose(Eigen::AngleAxisd(0.25 * std::sin(k), Eigen::Vector3d::UnitY()) *
                             Eigen::AngleAxisd(0.2 * std::cos(2 * k), Eigen::Vector3d::UnitX()));
      pose.translation() = Eigen::Vector3d(0.1 * k - 0.5, 0.2 * std::sin(1.7 * k), -0.05 * (k % 3));
      truth.push_back(pose);
    }
    std::vector<int> seen(points.size(), kNone);
    for (const Eigen::Isometry3d& pose : truth) {
      auto features = std::make_shared<Features>();
      std::vector<std::size_t> ids;
      for (std::size_t p = 0; p < points.size(); ++p) {
        const Eigen::Vector3d in_camera = pose.inverse() * points[p];
        const Eigen::Vector2d at = camera.project(in_camera);
        if (in_camera.z() < 0.5 || at.x() < 0 || at.y() < 0 || at.x() > 639 || at.y() > 479)
          continue;
        const Eigen::Vector2d key = in_image(camera, lens, at);
        features->keys.emplace_back(static_cast<float>(key.x()), static_cast<float>(key.y()),
                                    31.0f);
        features->depth.push_back(
            static_cast<float>(1 / (1 / in_camera.z() + offsets.offset(at.x(), at.y()))));
        ids.push_back(p);
      }
      features->descriptors.resize(features->keys.size());
      features->index();
      Keyframe keyframe;
      keyframe.features = features;
      keyframe.world_from_camera = pose;
      const int index = map.add_keyframe(keyframe);
      for (std::size_t k = 0; k < ids.size(); ++k) {
        const int key = static_cast<int>(k);
        const cv::Point2f& at = features->keys[k].pt;
        if (seen[ids[k]] == kNone)
          seen[ids[k]] = map.add_point(
              index, key,
              pose * camera.unproject(at.x, at.y, static_cast<double>(features->depth[k])));
        else
          map.add_observation(seen[ids[k]], {index, key});
      }
    }
  }

  BundleProblem problem() const {
    std::vector<int> free(truth.size() - 1);
    std::iota(free.begin(), free.end(), 1);
    BundleProblem result = bundle_of(map, free, {0}, {});
    result.calibrate = true;
    return result;
  }

  void adjust_all(bool with_lens = false) {
    BundleProblem problem = this->problem();
    problem.calibrate_lens = with_lens;
    adjust(camera, problem, 30, 1);
    apply(camera, problem, map);
  }
};

// RMS of the field: 3 mm/m^2, 2.7 cm at 3 m. A tenth remains where few points are.
TEST(DepthCalibration, AdjustmentFindsIt) {
  const DepthCalibration offsets = field();
  Scene scene(offsets);
  scene.adjust_all();
  EXPECT_LT(scene.map.calibration.difference(offsets), 6e-4);
  for (std::size_t k = 0; k < scene.truth.size(); ++k)
    EXPECT_LT(
        (scene.map.keyframes[k].world_from_camera.translation() - scene.truth[k].translation())
            .norm(),
        2e-3)
        << k;
}

// A focal length that is 7 pixels off, a centre that is 9 off, and distortion by 3 pixels in the
// corners. Features go to where the pinhole has them.
TEST(DepthCalibration, AdjustmentFindsTheLens) {
  const Lens lens = {7, 7, -4, 8, 0.05, -0.07};
  Scene scene(field(), lens);
  const auto features = scene.map.keyframes[5].features;
  scene.adjust_all();
  EXPECT_EQ(scene.map.calibration.lens, Lens{}) << "nobody asked for it";
  scene.adjust_all(true);
  const Lens& found = scene.map.calibration.lens;
  for (std::size_t k = 0; k < 4; ++k) EXPECT_NEAR(found[k], lens[k], 0.5) << k;
  for (std::size_t k = 4; k < 6; ++k) EXPECT_NEAR(found[k], lens[k], 0.01) << k;
  EXPECT_LT(scene.map.calibration.difference(field()), 1e-3);
  const Features& now = *scene.map.keyframes[5].features;
  for (std::size_t k = 0; k < now.size(); k += 20) {
    const cv::Point2f before = features->keys[k].pt;
    const Eigen::Vector2d pixel = in_pinhole(scene.camera, lens, {before.x, before.y});
    EXPECT_LT(std::hypot(now.keys[k].pt.x - pixel.x(), now.keys[k].pt.y - pixel.y()), 0.5) << k;
  }
  EXPECT_LT((scene.map.keyframes[5].world_from_camera.translation() - scene.truth[5].translation())
                .norm(),
            5e-3);
}

// Ceres sorts by addresses: the poses lie after the offsets in one problem, before them in the
// other.
TEST(DepthCalibration, TheBitsDoNotDependOnAddresses) {
  const Scene scene(field());
  std::vector<BundleProblem> problems(2, scene.problem());
  const auto before = [](const BundleProblem& p) {
    return std::less<const void*>()(p.poses.data(), p.calibration.offsets.data());
  };
  // Somewhere among these there is memory on the other side.
  std::vector<std::vector<BundleProblem::Pose>> elsewhere;
  while (before(problems[0]) == before(problems[1]) && elsewhere.size() < 100) {
    elsewhere.push_back(problems[1].poses);
    elsewhere.back().reserve(std::size_t{1} << (elsewhere.size() % 20));
    elsewhere.back().swap(problems[1].poses);
  }
  for (BundleProblem& problem : problems) adjust(scene.camera, problem, 5, 1);
  EXPECT_EQ(problems[0].calibration.offsets, problems[1].calibration.offsets);
  EXPECT_EQ(problems[0].poses, problems[1].poses);
}

TEST(DepthCalibration, ACameraWithoutOffsetsGetsNone) {
  Scene scene{DepthCalibration()};
  scene.adjust_all();
  EXPECT_LT(scene.map.calibration.difference({}), 1e-5) << "pixels and depths are floats";
  scene.adjust_all(true);
  for (const double number : scene.map.calibration.lens) EXPECT_LT(std::abs(number), 0.01);
}

}  // namespace
}  // namespace slam_demo
