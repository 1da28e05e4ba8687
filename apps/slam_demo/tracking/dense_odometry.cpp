// SPDX-License-Identifier: BSD-3-Clause
#include "tracking/dense_odometry.hpp"

#include <opencv2/core/eigen.hpp>
#include <opencv2/imgproc.hpp>

namespace slam_demo {
namespace {

constexpr double kMaxShift = 0.15, kMaxTurn = 0.25;  // metres, radians a frame: 4.5 m/s, 430 deg/s
constexpr double kMaxSurprise = 0.03;                // metres between the motion and the guess
constexpr double kMinDepths = 0.2;                   // share of the pixels

/// Every second pixel: four times as fast, and as good, as the noise of neighbours is alike.
cv::Mat halved(const cv::Mat& image) {
  cv::Mat result;
  cv::resize(image, result, image.size() / 2, 0, 0, cv::INTER_NEAREST);
  return result;
}

}  // namespace

DenseOdometry::DenseOdometry(const Pinhole& camera)
    : odometry_(cv::rgbd::RgbdICPOdometry::create(cv::Mat(cv::Matx33f(
          static_cast<float>(camera.fx / 2), 0, static_cast<float>(camera.cx / 2), 0,
          static_cast<float>(camera.fy / 2), static_cast<float>(camera.cy / 2), 0, 0, 1)))) {}

std::optional<Eigen::Isometry3d> DenseOdometry::motion(const cv::Mat1b& grey_before,
                                                       const cv::Mat1f& before,
                                                       const cv::Mat1b& grey_now,
                                                       const cv::Mat1f& now,
                                                       const Eigen::Isometry3d& guess) const {
  if (before.empty() || now.empty()) return std::nullopt;
  const cv::Mat source = halved(before), target = halved(now);
  if (cv::countNonZero(source) < kMinDepths * static_cast<double>(source.total()) ||
      cv::countNonZero(target) < kMinDepths * static_cast<double>(target.total()))
    return std::nullopt;
  cv::Mat initial, found;
  cv::eigen2cv(Eigen::Matrix4d(guess.inverse().matrix()), initial);
  if (!odometry_->compute(halved(grey_before), source, cv::Mat(), halved(grey_now), target,
                          cv::Mat(), found, initial))
    return std::nullopt;
  Eigen::Matrix4d now_from_before;
  cv::cv2eigen(found, now_from_before);
  if (!now_from_before.allFinite()) return std::nullopt;
  Eigen::Isometry3d motion = Eigen::Isometry3d::Identity();
  motion.linear() =
      Eigen::Quaterniond(now_from_before.topLeftCorner<3, 3>()).normalized().toRotationMatrix();
  motion.translation() = now_from_before.topRightCorner<3, 1>();
  motion = motion.inverse();
  if (motion.translation().norm() > kMaxShift ||
      Eigen::AngleAxisd(motion.linear()).angle() > kMaxTurn ||
      (guess.inverse() * motion).translation().norm() > kMaxSurprise)
    return std::nullopt;
  return motion;
}

}  // namespace slam_demo
