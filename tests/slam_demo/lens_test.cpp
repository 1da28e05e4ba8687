// SPDX-License-Identifier: BSD-3-Clause
#include "lens.hpp"

#include <gtest/gtest.h>

#include <opencv2/calib3d.hpp>
#include <opencv2/imgproc.hpp>

namespace slam_demo {
namespace {

const Pinhole kCamera{520, 515, 320, 240};
constexpr Lens kLens = {5, -3, 4, 12, 0.08, -0.12};

// OpenCV projects points by the same model.
TEST(Lens, IsBrownConradysModel) {
  const cv::Matx33d k(kCamera.fx + kLens[0], 0, kCamera.cx + kLens[2], 0, kCamera.fy + kLens[1],
                      kCamera.cy + kLens[3], 0, 0, 1);
  const cv::Vec4d distortion(kLens[4], kLens[5], 0, 0);
  for (const double u : {0.0, 100.0, 320.0, 639.0}) {
    for (const double v : {0.0, 250.0, 479.0}) {
      const Eigen::Vector3d p = kCamera.unproject(u, v, 2);
      std::vector<cv::Point2d> pixels;
      cv::projectPoints(std::vector<cv::Point3d>{{p.x(), p.y(), p.z()}}, cv::Vec3d(), cv::Vec3d(),
                        k, distortion, pixels);
      const Eigen::Vector2d there = in_image(kCamera, kLens, {u, v});
      EXPECT_NEAR(there.x(), pixels[0].x, 1e-9) << u << " " << v;
      EXPECT_NEAR(there.y(), pixels[0].y, 1e-9) << u << " " << v;
      EXPECT_LT((in_pinhole(kCamera, kLens, there) - Eigen::Vector2d(u, v)).norm(), 1e-6)
          << u << " " << v;
    }
  }
}

// A line through the image, taken by the lens, is where the pinhole has it again.
TEST(Lens, ImagesAreThoseOfThePinhole) {
  cv::Mat1b pinhole(480, 640, std::uint8_t{0}), image(480, 640, std::uint8_t{0});
  for (int v = 0; v < 480; ++v) {
    for (int u = 0; u < 640; ++u) {
      const Eigen::Vector2d from = in_pinhole(kCamera, kLens, Eigen::Vector2d(u, v));
      // Smooth, so that interpolation changes little.
      image(v, u) = static_cast<std::uint8_t>(128 + 100 * std::sin(0.05 * from.x()) *
                                                        std::cos(0.04 * from.y()));
      pinhole(v, u) =
          static_cast<std::uint8_t>(128 + 100 * std::sin(0.05 * u) * std::cos(0.04 * v));
    }
  }
  const cv::Mat1b seen = Rectification(kCamera, kLens, image.size())(image, cv::INTER_LINEAR);
  double largest = 0, before = 0;
  const cv::Rect inside(40, 40, 560, 400);
  cv::minMaxLoc(cv::abs(cv::Mat1s(seen(inside)) - cv::Mat1s(pinhole(inside))), nullptr, &largest);
  cv::minMaxLoc(cv::abs(cv::Mat1s(image(inside)) - cv::Mat1s(pinhole(inside))), nullptr, &before);
  EXPECT_LE(largest, 3) << "of 256: both are rounded down";
  EXPECT_GT(before, 30);
  EXPECT_EQ(Rectification(kCamera, {}, image.size())(image, cv::INTER_LINEAR).data, image.data)
      << "nothing to do";
}

}  // namespace
}  // namespace slam_demo
