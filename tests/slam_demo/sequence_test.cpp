// SPDX-License-Identifier: BSD-3-Clause
#include "sequence.hpp"

#include <gtest/gtest.h>
#include <gpureg/error.hpp>

#include <algorithm>
#include <clocale>
#include <ctime>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <opencv2/imgcodecs.hpp>

#include "support/temporary_folder.hpp"

namespace slam_demo {
namespace {

namespace fs = std::filesystem;
using gpureg::test::TemporaryFolder;

void write(const fs::path& path, const std::string& text) {
  fs::create_directories(path.parent_path());
  std::ofstream(path) << text;
}

/// A grey image and a wall at depth `value`.
void write_images(const fs::path& colour, const fs::path& depth, int value) {
  fs::create_directories(colour.parent_path());
  fs::create_directories(depth.parent_path());
  cv::imwrite(colour.string(), cv::Mat3b(48, 64, cv::Vec3b(10, 20, 30)));
  cv::imwrite(depth.string(), cv::Mat1w(48, 64, static_cast<std::uint16_t>(value)));
}

std::string refusal_of(const std::string& folder) {
  try {
    open_sequence(folder);
  } catch (const gpureg::IoError& error) {
    return error.what();
  }
  return "";
}

TEST(Sequence, TumWithAssociations) {
  const TemporaryFolder folder;
  write_images(folder / "rgb/1.png", folder / "depth/1.png", 10000);
  write(folder / "associations.txt",
        "# time rgb time depth\n1.0 rgb/1.png 1.01 depth/1.png\n2.0 rgb/2.png 2.0 depth/2.png\n");
  write(folder / "groundtruth.txt", "# comment\n1.0 1 2 3 0 0 0 1\n");
  const Sequence sequence = open_sequence(folder.path());
  EXPECT_EQ(sequence.layout, "TUM");
  ASSERT_EQ(sequence.frames.size(), 2u);
  EXPECT_EQ(sequence.frames[0].time, 1.0);
  EXPECT_NEAR(sequence.frames[0].depth_delay, 0.01, 1e-12);
  EXPECT_EQ(sequence.frames[1].depth_delay, 0);
  ASSERT_EQ(sequence.truth.size(), 1u);
  EXPECT_EQ(Eigen::Vector3d(sequence.truth[0].world_from_body.topRightCorner<3, 1>()),
            Eigen::Vector3d(1, 2, 3));
  const Images first = load(sequence.frames[0], sequence.rig);
  EXPECT_EQ(first.problem, "");
  EXPECT_EQ(first.depth_delay, sequence.frames[0].depth_delay);
  EXPECT_FLOAT_EQ(first.depth(20, 30), 2.0f) << "10000 / 5000";
  EXPECT_EQ(first.grey.size(), cv::Size(64, 48));
  EXPECT_NE(load(sequence.frames[1], sequence.rig).problem.find("2.png"), std::string::npos);
}

TEST(Sequence, IclNamesTheDepthFirst) {
  const TemporaryFolder folder;
  write(folder / "associations.txt", "1 depth/1.png 1.5 rgb/1.png\n");
  write(folder / "living.gt.freiburg", "1 0 0 5 0 0 0 1\n");
  const Sequence sequence = open_sequence(folder.path());
  EXPECT_NE(sequence.frames.front().colour.find("rgb/1.png"), std::string::npos);
  EXPECT_NE(sequence.frames.front().depth.find("depth/1.png"), std::string::npos);
  EXPECT_EQ(sequence.frames.front().time, 1.5) << "of the colour image";
  EXPECT_EQ(sequence.frames.front().depth_delay, -0.5);
  EXPECT_EQ(sequence.truth.size(), 1u);
}

TEST(Sequence, TumWithTwoListsPairsByTime) {
  const TemporaryFolder folder;
  write(folder / "rgb.txt", "1.00 rgb/a.png\n1.50 rgb/b.png\n2.00 rgb/c.png\n");
  write(folder / "depth.txt", "2.015 depth/c.png\n0.99 depth/a.png\n1.40 depth/x.png\n");
  const Sequence sequence = open_sequence(folder.path());
  ASSERT_EQ(sequence.frames.size(), 2u) << "nothing within 20 ms of 1.50";
  EXPECT_NE(sequence.frames[0].depth.find("a.png"), std::string::npos);
  EXPECT_NE(sequence.frames[1].depth.find("c.png"), std::string::npos);
  EXPECT_NEAR(sequence.frames[0].depth_delay, -0.01, 1e-12);
  EXPECT_NEAR(sequence.frames[1].depth_delay, 0.015, 1e-12);
}

TEST(Sequence, TimesOutOfOrderAreLeftOut) {
  const TemporaryFolder folder;
  write(folder / "associations.txt",
        "1 rgb/1.png 1 depth/1.png\n3 rgb/3.png 3 depth/3.png\n2 rgb/2.png 2 depth/2.png\n"
        "3 rgb/3.png 3 depth/3.png\n4 rgb/4.png 4 depth/4.png\n");
  const Sequence sequence = open_sequence(folder.path());
  EXPECT_EQ(sequence.frames.size(), 3u);
  EXPECT_EQ(sequence.out_of_order, 2u);
}

TEST(Sequence, Redwood) {
  const TemporaryFolder folder;
  write_images(folder / "color/00001.jpg", folder / "depth/00001.png", 1500);
  write_images(folder / "color/00000.jpg", folder / "depth/00000.png", 1500);
  write_images(folder / "color/00007.jpg", folder / "elsewhere/7.png", 1);
  write(folder / "trajectory.log", "0 0 1\n1 0 0 4\n0 1 0 5\n0 0 1 6\n0 0 0 1\n");
  const Sequence sequence = open_sequence(folder.path());
  EXPECT_EQ(sequence.layout, "Redwood");
  ASSERT_EQ(sequence.frames.size(), 2u) << "7 has no depth";
  EXPECT_NEAR(sequence.frames[1].time, 1 / 30.0, 1e-12);
  EXPECT_FLOAT_EQ(load(sequence.frames[0], sequence.rig).depth(5, 5), 1.5f);
  ASSERT_EQ(sequence.truth.size(), 1u);
  EXPECT_EQ(Eigen::Vector3d(sequence.truth[0].world_from_body.topRightCorner<3, 1>()),
            Eigen::Vector3d(4, 5, 6));
}

TEST(Sequence, SevenScenesPutsDepthIntoTheColourCamera) {
  const TemporaryFolder folder;
  write_images(folder / "frame-000003.color.png", folder / "frame-000003.depth.png", 1000);
  write(folder / "frame-000003.pose.txt", "1 0 0 1\n0 1 0 0\n0 0 1 0\n0 0 0 1\n");
  write(folder / "camera-intrinsics.txt", "60 0 32\n0 60 24\n0 0 1\n");
  Sequence sequence = open_sequence(folder.path());
  EXPECT_EQ(sequence.layout, "7-Scenes");
  EXPECT_FALSE(sequence.rig.registered);
  EXPECT_EQ(sequence.rig.depth.fx, 60);
  ASSERT_EQ(sequence.truth.size(), 1u);

  // One depth pixel in front of a known colour pixel: 32 + (45 - 32) / 60 m right of the axis,
  // 10 cm to the left by the baseline, times 30 px.
  cv::Mat1w raw(48, 64, static_cast<std::uint16_t>(0));
  raw(24, 45) = 1000;
  sequence.rig.colour = {30, 30, 32, 24};
  sequence.rig.colour_from_depth.translation() = Eigen::Vector3d(-0.1, 0, 0);
  const cv::Mat1f depth = depth_in_colour(raw, sequence.rig);
  const double u = 32 + 30 * (13 / 60.0 - 0.1);  // 35.5
  for (int y = 0; y < 48; ++y) {
    for (int x = 0; x < 64; ++x) {
      const bool hit =
          (y == 24 || y == 25) && (x == static_cast<int>(u) || x == static_cast<int>(u) + 1);
      ASSERT_FLOAT_EQ(depth(y, x), hit ? 1.0f : 0.0f) << x << " " << y;
    }
  }
}

// A wall 2 m in front, and a camera that has gone 0.5 m ahead and turned by ten degrees.
TEST(Sequence, DepthFromElsewhere) {
  const Pinhole camera{60, 60, 32, 24};
  const cv::Mat1f wall(48, 64, 2.0f);
  EXPECT_EQ(
      cv::countNonZero(seen_from(camera, Eigen::Isometry3d::Identity(), camera, wall) != wall), 0);
  Eigen::Isometry3d wall_from_there = Eigen::Isometry3d::Identity();
  wall_from_there.translate(Eigen::Vector3d(0, 0, 0.5));
  wall_from_there.rotate(Eigen::AngleAxisd(M_PI / 18, Eigen::Vector3d::UnitY()));
  const cv::Mat1f seen = seen_from(camera, wall_from_there.inverse(), camera, wall);
  for (const auto& [u, v] : {std::pair{32, 24}, std::pair{20, 10}, std::pair{38, 40}}) {
    const Eigen::Vector3d ray = wall_from_there.linear() * camera.unproject(u, v, 1);
    // A pixel is as wide as 1/60 of the depth, and the wall is slanted by ten degrees.
    EXPECT_NEAR(seen(v, u), 1.5 / ray.z(), 0.01) << u << " " << v;
  }
}

TEST(Sequence, NearSurfacesHideFarOnes) {
  Rig rig;
  rig.registered = false;
  rig.depth_units = 1000;
  rig.colour = rig.depth = {60, 60, 32, 24};
  cv::Mat1w raw(48, 64, static_cast<std::uint16_t>(2000));
  raw(10, 11) = 1000;
  const cv::Mat1f depth = depth_in_colour(raw, rig);
  EXPECT_FLOAT_EQ(depth(10, 11), 1.0f);
  EXPECT_FLOAT_EQ(depth(30, 30), 2.0f);
}

TEST(Sequence, DepthsOutOfRangeAndMarksAreDropped) {
  Rig rig;
  rig.depth_units = 1000;
  cv::Mat1w raw(1, 4);
  raw << 0, 65535, 200, 3000;
  const cv::Mat1f depth = depth_in_colour(raw, rig);
  EXPECT_EQ(depth(0, 0), 0);
  EXPECT_EQ(depth(0, 1), 0);
  EXPECT_EQ(depth(0, 2), 0) << "nearer than 0.3 m";
  EXPECT_FLOAT_EQ(depth(0, 3), 3);
}

TEST(Sequence, DamagedFilesAreNamed) {
  const TemporaryFolder folder;
  write_images(folder / "rgb/1.png", folder / "depth/1.png", 5000);
  fs::resize_file(folder / "depth/1.png", fs::file_size(folder / "depth/1.png") / 2);
  const FrameFiles files{1, folder / "rgb/1.png", folder / "depth/1.png"};
  const Images images = load(files, Rig{});
  EXPECT_NE(images.problem.find("depth/1.png"), std::string::npos);
  EXPECT_TRUE(images.grey.empty()) << "a frame without depth is no frame";
  cv::imwrite(folder / "depth/1.png", cv::Mat1b(48, 64, std::uint8_t{9}));
  EXPECT_NE(load(files, Rig{}).problem.find("16 bit"), std::string::npos);
  cv::imwrite(folder / "depth/1.png", cv::Mat1w(40, 64, std::uint16_t{900}));
  EXPECT_NE(load(files, Rig{}).problem.find("size"), std::string::npos);
}

TEST(Sequence, NearestTimesAsALinearSearchFindsThem) {
  const TemporaryFolder folder;
  write(folder / "rgb.txt", "1.00 rgb/a.png\n2.00 rgb/b.png\n3.00 rgb/c.png\n");
  // Of b two are exactly as near: the earlier one. Of c two have the same time: the first of the
  // file.
  write(folder / "depth.txt",
        "1.984375 depth/b.png\n2.015625 depth/x.png\n2.99 depth/c.png\n2.99 depth/y.png\n");
  const Sequence sequence = open_sequence(folder.path());
  ASSERT_EQ(sequence.frames.size(), 2u);
  EXPECT_NE(sequence.frames[0].depth.find("b.png"), std::string::npos);
  EXPECT_NE(sequence.frames[1].depth.find("c.png"), std::string::npos);
}

TEST(Sequence, ListsOfAnHourArePairedInNoTime) {
  const TemporaryFolder folder;
  std::string colour, depth;
  for (int k = 0; k < 100000; ++k) {
    const std::string time = std::to_string(k / 30.0);
    colour += time + " c.png\n";
    depth += time + " d.png\n";
  }
  write(folder / "rgb.txt", colour);
  write(folder / "depth.txt", depth);
  const std::clock_t begin = std::clock();
  EXPECT_EQ(open_sequence(folder.path()).frames.size(), 100000u);
  // Below a second; comparing each with each took 10^10 steps, half a minute.
  EXPECT_LT(std::clock() - begin, 15 * CLOCKS_PER_SEC);
}

TEST(Sequence, SeveralLogs) {
  const TemporaryFolder folder;
  write_images(folder / "color/0.jpg", folder / "depth/0.png", 1500);
  const auto log = [](int x) {
    return "0 0 1\n1 0 0 " + std::to_string(x) + "\n0 1 0 0\n0 0 1 0\n0 0 0 1\n";
  };
  write(folder / "b.log", log(2));
  write(folder / "a.log", log(1));
  const std::string message = refusal_of(folder.path());
  EXPECT_NE(message.find("a.log and "), std::string::npos) << message;
  EXPECT_NE(message.find("b.log: only one"), std::string::npos) << message;
  write(folder / "trajectory.log", log(3));
  EXPECT_EQ(open_sequence(folder.path()).truth.at(0).world_from_body(0, 3), 3);

  const TemporaryFolder tum;
  write(tum / "associations.txt", "1 depth/1.png 1 rgb/1.png\n");
  write(tum / "a.gt.freiburg", "1 0 0 5 0 0 0 1\n");
  write(tum / "b.gt.freiburg", "1 0 0 5 0 0 0 1\n");
  EXPECT_NE(refusal_of(tum.path()).find("a.gt.freiburg and "), std::string::npos);
}

// Programs that show windows set the user's locale, in which 1.5 may be 1,5.
TEST(Sequence, NumbersDoNotDependOnTheLocale) {
  const char* const names[] = {"de_DE.UTF-8", "de_DE.utf8", "fr_FR.UTF-8", "de_DE"};
  const bool set = std::any_of(std::begin(names), std::end(names), [](const char* name) {
    return std::setlocale(LC_ALL, name) != nullptr;
  });
  const TemporaryFolder folder;
  write(folder / "associations.txt", "1.5 rgb/1.png 1.5 depth/1.png\n");
  double time = 0;
  EXPECT_NO_THROW(time = open_sequence(folder.path()).frames.at(0).time);
  std::setlocale(LC_ALL, "C");
  EXPECT_EQ(time, 1.5);
  if (!set) GTEST_SKIP() << "this machine has no locale with a decimal comma";
}

TEST(Sequence, ErrorsNameTheFile) {
  const TemporaryFolder folder;
  EXPECT_NE(refusal_of(folder / "nowhere").find("nowhere"), std::string::npos);
  EXPECT_NE(refusal_of(folder.path()).find("no frames"), std::string::npos);
  write(folder / "associations.txt", "1 rgb/1.png 1\n");
  EXPECT_NE(refusal_of(folder.path()).find("associations.txt:1"), std::string::npos);
  write(folder / "associations.txt", "one rgb/1.png 1 depth/1.png\n");
  EXPECT_NE(refusal_of(folder.path()).find("'one'"), std::string::npos);
  write(folder / "associations.txt", "1 rgb/1.png 1 depth/1.png\n");
  write(folder / "groundtruth.txt", "1 2 3\n");
  EXPECT_NE(refusal_of(folder.path()).find("groundtruth.txt:1"), std::string::npos);
}

}  // namespace
}  // namespace slam_demo
