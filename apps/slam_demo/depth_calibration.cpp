// SPDX-License-Identifier: BSD-3-Clause
#include "depth_calibration.hpp"

#include <algorithm>
#include <cmath>
#include <fstream>
#include <gpureg/error.hpp>
#include <gpureg/files.hpp>
#include <nlohmann/json.hpp>

namespace slam_demo {
namespace {

constexpr double kFarthest = 0.01;  // 1/metres: no correction puts a point farther than 100 m
constexpr double kLargest = 1;      // 1/metres: a file with more is not of a depth camera

double place(double x, int pixels, int nodes) {
  return std::clamp(x / (pixels - 1), 0.0, 1.0) * (nodes - 1);
}

}  // namespace

std::array<DepthCalibration::Weight, 4> DepthCalibration::around(double u, double v) const {
  const double x = place(u, width, kColumns), y = place(v, height, kRows);
  const int column = std::min(static_cast<int>(x), kColumns - 2),
            row = std::min(static_cast<int>(y), kRows - 2);
  const double a = x - column, b = y - row;
  const auto node = static_cast<std::size_t>(row * kColumns + column);
  return {{{node, (1 - a) * (1 - b)},
           {node + 1, a * (1 - b)},
           {node + kColumns, (1 - a) * b},
           {node + kColumns + 1, a * b}}};
}

double DepthCalibration::offset(double u, double v) const {
  double sum = 0;
  for (const Weight& w : around(u, v)) sum += w.share * offsets[w.node];
  return sum;
}

double DepthCalibration::corrected(double u, double v, double depth) const {
  return depth > 0 ? 1 / std::max(kFarthest, 1 / depth - offset(u, v)) : 0;
}

cv::Mat1f DepthCalibration::corrected(const cv::Mat1f& depth) const {
  if (difference({width, height, {}}) == 0) return depth;
  cv::Mat1f result(depth.size());
  for (int y = 0; y < depth.rows; ++y) {
    for (int x = 0; x < depth.cols; ++x)
      result(y, x) = static_cast<float>(corrected(x, y, static_cast<double>(depth(y, x))));
  }
  return result;
}

Eigen::Vector3d DepthCalibration::moved(const Pinhole& camera, const DepthCalibration& before,
                                        const Eigen::Vector3d& point) const {
  if (!(point.z() > 0)) return point;
  const Eigen::Vector2d at = camera.project(point);
  const double change = before.offset(at.x(), at.y()) - offset(at.x(), at.y());
  return point / std::max(kFarthest * point.z(), 1 + change * point.z());
}

double DepthCalibration::difference(const DepthCalibration& other) const {
  double largest = 0;
  for (std::size_t k = 0; k < kNodes; ++k)
    largest = std::max(largest, std::abs(offsets[k] - other.offsets[k]));
  return largest;
}

void write_depth_calibration(const std::string& path, const DepthCalibration& c) {
  const nlohmann::json page = {{"columns", DepthCalibration::kColumns},
                               {"rows", DepthCalibration::kRows},
                               {"width", c.width},
                               {"height", c.height},
                               {"inverse_depth_offsets", c.offsets},
                               {"lens", c.lens}};
  gpureg::files::write_atomically(path, page.dump(1) + "\n");
}

DepthCalibration read_depth_calibration(const std::string& path) {
  std::ifstream file(path);
  if (!file) throw gpureg::IoError(path + ": cannot be read");
  DepthCalibration c;
  try {
    const auto page = nlohmann::json::parse(file);
    if (page.at("columns") != DepthCalibration::kColumns ||
        page.at("rows") != DepthCalibration::kRows ||
        page.at("inverse_depth_offsets").size() != DepthCalibration::kNodes)
      throw gpureg::IoError(path + ": needs 9 columns and 7 rows of offsets");
    page.at("width").get_to(c.width);
    page.at("height").get_to(c.height);
    page.at("inverse_depth_offsets").get_to(c.offsets);
    if (page.contains("lens")) page.at("lens").get_to(c.lens);
  } catch (const nlohmann::json::exception& error) {
    throw gpureg::IoError(path + ": is no depth calibration: " + error.what());
  }
  if (c.width < 2 || c.height < 2 || !(c.difference({}) < kLargest))
    throw gpureg::IoError(path + ": has no image size, or offsets of 1 1/m and more");
  return c;
}

}  // namespace slam_demo
