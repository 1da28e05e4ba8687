// SPDX-License-Identifier: BSD-3-Clause
#include "camera_file.hpp"

#include <gtest/gtest.h>
#include <gpureg/error.hpp>

#include <filesystem>
#include <fstream>
#include <opencv2/imgcodecs.hpp>

#include "sequence.hpp"
#include "support/temporary_folder.hpp"

namespace slam_demo {
namespace {

namespace fs = std::filesystem;
using gpureg::test::TemporaryFolder;

std::string matrix(const char* name, int rows, int columns, const std::string& data) {
  return std::string(name) + ": !!opencv-matrix\n   rows: " + std::to_string(rows) +
         "\n   cols: " + std::to_string(columns) + "\n   dt: d\n   data: [ " + data + " ]\n";
}

const std::string kHead = "%YAML:1.0\n---\nimage_width: 64\nimage_height: 48\n";
const std::string kMatrix = matrix("camera_matrix", 3, 3, "60., 0., 31., 0., 61., 24., 0., 0., 1.");

std::string message_of(const std::string& path) {
  Rig rig;
  try {
    read_camera(path, rig);
  } catch (const gpureg::IoError& error) {
    return error.what();
  }
  return "";
}

TEST(CameraFile, DistortionIsTakenOut) {
  const TemporaryFolder folder;
  folder.write("camera.yaml",
               kHead + kMatrix + "depth_units: 1000\n" +
                   matrix("distortion_coefficients", 1, 5, "0.2, -0.1, 0.01, -0.02, 0.05"));
  Rig rig;
  read_camera(folder / "camera.yaml", rig);
  EXPECT_TRUE(rig.known);
  EXPECT_TRUE(rig.registered);
  EXPECT_EQ(rig.colour.fx, 60);
  EXPECT_EQ(rig.colour.fy, 61);
  EXPECT_EQ(rig.colour.cx, 31);
  EXPECT_EQ(rig.depth_units, 1000);
  // Brown 1966 by hand, at pixel (55, 8).
  const double x = (55 - 31) / 60.0, y = (8 - 24) / 61.0, r2 = x * x + y * y,
               radial = 1 + 0.2 * r2 - 0.1 * r2 * r2 + 0.05 * r2 * r2 * r2,
               u = 60 * (x * radial + 2 * 0.01 * x * y - 0.02 * (r2 + 2 * x * x)) + 31,
               v = 61 * (y * radial + 0.01 * (r2 + 2 * y * y) - 2 * 0.02 * x * y) + 24;
  EXPECT_NEAR(rig.undistort_x.at<float>(8, 55), u, 1e-4);
  EXPECT_NEAR(rig.undistort_y.at<float>(8, 55), v, 1e-4);

  // What the camera sees there comes to that pixel: colours and depths alike.
  cv::Mat3b colour(48, 64, cv::Vec3b(0, 0, 0));
  cv::Mat1w depth(48, 64, static_cast<std::uint16_t>(0));
  const cv::Rect around(cvRound(u) - 2, cvRound(v) - 2, 5, 5);
  colour(around).setTo(cv::Scalar(200, 200, 200));
  depth(around).setTo(1500);
  cv::imwrite(folder / "c.png", colour);
  cv::imwrite(folder / "d.png", depth);
  const Images images = load({0, folder / "c.png", folder / "d.png"}, rig);
  EXPECT_EQ(images.problem, "");
  EXPECT_EQ(images.grey(8, 55), 200);
  EXPECT_FLOAT_EQ(images.depth(8, 55), 1.5f);

  cv::imwrite(folder / "c.png", cv::Mat3b(24, 32));
  cv::imwrite(folder / "d.png", cv::Mat1w(24, 32));
  EXPECT_NE(load({0, folder / "c.png", folder / "d.png"}, rig).problem.find("size of the camera"),
            std::string::npos);
}

TEST(CameraFile, TheDepthCamera) {
  const TemporaryFolder folder;
  folder.write("camera.yaml",
               kHead + kMatrix +
                   matrix("depth_camera_matrix", 3, 3, "50., 0., 32., 0., 51., 24., 0., 0., 1.") +
                   matrix("colour_from_depth", 4, 4,
                          "1., 0., 0., .025, 0., 1., 0., 0., 0., 0., 1., 0., 0., 0., 0., 1."));
  Rig rig;
  read_camera(folder / "camera.yaml", rig);
  EXPECT_FALSE(rig.registered);
  EXPECT_EQ(rig.depth.fy, 51);
  EXPECT_EQ(rig.colour_from_depth.translation().x(), 0.025);
}

TEST(CameraFile, WhatIsWrongIsNamed) {
  const TemporaryFolder folder;
  const std::string path = folder / "camera.yaml";
  EXPECT_NE(message_of(path).find("camera.yaml: cannot be read"), std::string::npos);
  for (const auto& [text, named] :
       {std::pair<std::string, std::string>{"no yaml: [", "FileStorage"},
        {kHead, "camera_matrix"},
        {"%YAML:1.0\n---\n" + kMatrix, "image_width"},
        {kHead + matrix("camera_matrix", 1, 2, "1., 2."), "3 x 3"},
        {kHead + matrix("camera_matrix", 3, 3, "0., 0., 31., 0., 61., 24., 0., 0., 1."), "focal"},
        {kHead + kMatrix + matrix("distortion_coefficients", 1, 3, "0.2, -0.1, 0.01"), "4, 5 or 8"},
        {kHead + kMatrix + "depth_units: -1\n", "depth_units"}}) {
    folder.write("camera.yaml", text);
    const std::string message = message_of(path);
    EXPECT_NE(message.find("camera.yaml"), std::string::npos) << text;
    EXPECT_NE(message.find(named), std::string::npos) << text << "\n" << message;
  }
}

/// A sequence of TUM's layout with one frame, whose upper half is white.
void write_sequence(const fs::path& folder) {
  fs::create_directories(folder);
  cv::Mat3b colour(480, 640, cv::Vec3b(0, 0, 0));
  colour.rowRange(0, 240).setTo(cv::Scalar(255, 255, 255));
  cv::imwrite(folder / "c.png", colour);
  cv::imwrite(folder / "d.png", cv::Mat1w(480, 640, static_cast<std::uint16_t>(10000)));
  std::ofstream(folder / "associations.txt") << "1 c.png 1 d.png\n";
}

TEST(CameraFile, PublishedCamerasAreKnownByName) {
  const TemporaryFolder folder;
  const fs::path root = folder.path();
  for (const auto& [name, fx, distorted] :
       {std::tuple{"rgbd_dataset_freiburg1_rpy", 517.3, true},
        std::tuple{"rgbd_dataset_freiburg2_xyz", 520.9, true},
        std::tuple{"rgbd_dataset_freiburg3_long", 535.4, false}}) {
    write_sequence(root / name);
    const Rig rig = open_sequence((root / name).string()).rig;
    EXPECT_TRUE(rig.known);
    EXPECT_EQ(rig.colour.fx, fx);
    EXPECT_EQ(rig.undistort_x.empty(), !distorted);
  }
  write_sequence(root / "data");
  EXPECT_FALSE(open_sequence((root / "data").string()).rig.known);
  std::ofstream(root / "data/rgb.txt")
      << "# color images\n# file: 'rgbd_dataset_freiburg1_rpy.bag'\n1 c.png\n";
  EXPECT_EQ(open_sequence((root / "data").string()).rig.colour.cy, 255.3) << "the bag's name";
  std::ofstream(root / "data/camera.yaml") << kHead << kMatrix;
  EXPECT_EQ(open_sequence((root / "data").string()).rig.colour.fx, 60) << "the file replaces it";
}

// ICL-NUIM publishes fy = -480: its camera's y points up.
TEST(CameraFile, ANegativeFocalLengthTurnsTheImages) {
  const TemporaryFolder folder;
  const fs::path root = fs::path(folder.path()) / "living_room_traj1_frei_png";
  write_sequence(root);
  const Sequence sequence = open_sequence(root.string());
  EXPECT_EQ(sequence.rig.colour.fx, 481.2);
  EXPECT_EQ(sequence.rig.colour.fy, 480);
  EXPECT_EQ(sequence.rig.colour.cy, 239.5);
  const Images images = load(sequence.frames[0], sequence.rig);
  EXPECT_EQ(images.grey(0, 5), 0);
  EXPECT_EQ(images.grey(479, 5), 255);
}

}  // namespace
}  // namespace slam_demo
