// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>
#include <png.h>

#include <cmath>
#include <set>

#include "data/sensor/camera.hpp"
#include "scene.hpp"

namespace gpureg::test {
namespace {

struct Png {
  png_uint_32 width = 0, height = 0;
  int bits = 0, colour = 0;
  std::vector<std::vector<std::uint8_t>> rows;
};

Png read_png(const std::string& path) {
  Png result;
  FILE* file = std::fopen(path.c_str(), "rb");
  if (file == nullptr) throw std::runtime_error(path + ": missing");
  png_structp png = png_create_read_struct(PNG_LIBPNG_VER_STRING, nullptr, nullptr, nullptr);
  png_infop info = png_create_info_struct(png);
  png_init_io(png, file);
  png_read_info(png, info);
  png_get_IHDR(png, info, &result.width, &result.height, &result.bits, &result.colour, nullptr,
               nullptr, nullptr);
  for (png_uint_32 y = 0; y < result.height; ++y) {
    result.rows.emplace_back(png_get_rowbytes(png, info));
    png_read_row(png, result.rows.back().data(), nullptr);
  }
  png_destroy_read_struct(&png, &info, nullptr);
  std::fclose(file);
  return result;
}

TEST(Rgbd, SequenceInTumLayout) {
  const TemporaryFolder folder;
  synthetic::GenerateOptions options = small_scene();
  options.fragments = 1;
  options.frames_per_fragment = 4;
  options.rgbd = true;
  synthetic::generate(folder.path(), options);

  std::ifstream list(folder / "associations.txt");
  std::string time, rgb, depth_time, depth;
  int frames = 0;
  for (; list >> time >> rgb >> depth_time >> depth; ++frames) {
    EXPECT_NEAR(std::stod(time), frames / 30.0, 1e-6);
    EXPECT_EQ(time, depth_time);
    const Png colour = read_png(folder / rgb), distance = read_png(folder / depth);
    EXPECT_EQ(colour.width, 640u);
    EXPECT_EQ(colour.height, 480u);
    EXPECT_EQ(colour.bits, 8);
    EXPECT_EQ(colour.colour, PNG_COLOR_TYPE_RGB);
    EXPECT_EQ(distance.width, 640u);
    EXPECT_EQ(distance.height, 480u);
    EXPECT_EQ(distance.bits, 16);
    EXPECT_EQ(distance.colour, PNG_COLOR_TYPE_GRAY);
    std::set<int> tones;
    int measured = 0;
    for (const auto& row : colour.rows) tones.insert(row.begin(), row.end());
    for (const auto& row : distance.rows) {
      for (std::size_t x = 0; x < 640; ++x) {
        const double z = (row[2 * x] * 256 + row[2 * x + 1]) / 5000.0;
        if (z == 0) continue;
        ++measured;
        ASSERT_GT(z, 0.39);
        ASSERT_LT(z, 4.01);
      }
    }
    EXPECT_GT(tones.size(), 60u) << "a textured picture";
    EXPECT_GT(measured, 640 * 480 / 4) << "the sensor sees the room";
  }
  EXPECT_EQ(frames, 4);

  // groundtruth.txt holds the exact poses; the first one is that of the fragment.
  std::ifstream truth(folder / "groundtruth.txt");
  std::string line;
  for (int k = 0; k < 4; ++k) std::getline(truth, line);  // three lines of comment
  std::istringstream numbers(line);
  double stamp;
  Eigen::Vector3d t;
  Eigen::Quaterniond q;
  numbers >> stamp >> t.x() >> t.y() >> t.z() >> q.x() >> q.y() >> q.z() >> q.w();
  const Eigen::Isometry3d first = read_poses(folder / "poses.txt").front();
  EXPECT_EQ(stamp, 0);
  EXPECT_LT((first.translation() - t).norm(), 1e-5);
  EXPECT_LT((first.linear() - q.normalized().toRotationMatrix()).norm(), 1e-5);

  // The depth image, moved by its pose, lies on the fragment: the two outputs tell of the same
  // room.
  const auto cloud = read_cloud(folder / "cloud_bin_0.ply");
  const Png distance = read_png(folder / "depth/0.000000.png");
  int near = 0, tried = 0;
  for (std::size_t y = 5; y < 480; y += 24) {
    for (std::size_t x = 5; x < 640; x += 24) {
      const float z =
          static_cast<float>(distance.rows[y][2 * x] * 256 + distance.rows[y][2 * x + 1]) / 5000.0f;
      if (z == 0) continue;
      const Eigen::Vector3f p =
          z * synthetic::camera::ray(static_cast<float>(x), static_cast<float>(y));
      float best = 1e9f;
      for (const Eigen::Vector3f& c : cloud) best = std::min(best, (c - p).squaredNorm());
      near += best < 0.05f * 0.05f ? 1 : 0;
      ++tried;
    }
  }
  EXPECT_GT(near, 0.9 * tried) << "of " << tried;

  // The true surface has a point within its spacing of whatever depth measures well, and unit
  // normals.
  const std::string bytes = content_of(folder / "surface.ply");
  const std::size_t body = bytes.find("end_header\n") + 11;
  const std::size_t count = std::stoul(bytes.substr(bytes.find("vertex ") + 7));
  ASSERT_EQ(bytes.size(), body + 24 * count);
  std::vector<Eigen::Matrix<float, 6, 1>> surface(count);
  std::memcpy(static_cast<void*>(surface.data()), bytes.data() + body, 24 * count);
  EXPECT_GT(count, 5000u);
  for (const auto& s : surface) ASSERT_NEAR(s.tail<3>().norm(), 1, 1e-5);
  near = tried = 0;
  for (std::size_t k = 0; k < cloud.size(); k += 50, ++tried) {
    const Eigen::Vector3f p = (first * cloud[k].cast<double>()).cast<float>();
    float best = 1e9f;
    for (const auto& s : surface) best = std::min(best, (s.head<3>() - p).squaredNorm());
    near += best < 0.05f * 0.05f ? 1 : 0;
  }
  EXPECT_GT(near, 0.9 * tried) << "of " << tried;
}

}  // namespace
}  // namespace gpureg::test
