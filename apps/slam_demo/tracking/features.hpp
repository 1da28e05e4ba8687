// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <cstdint>
#include <functional>
#include <opencv2/core.hpp>
#include <opencv2/features2d.hpp>
#include <vector>

namespace slam_demo {

using Descriptor = std::array<std::uint64_t, 4>;  ///< 256 bits of ORB
int hamming(const Descriptor& a, const Descriptor& b);

constexpr double kScaleFactor = 1.2;  ///< between the levels of the image pyramid
constexpr int kLevels = 8;
double scale_of(int octave);  ///< kScaleFactor to the power of octave

/// ORB features of one image (Rublee et al. 2011), spread over the image, with their depths.
struct Features {
  std::vector<cv::KeyPoint> keys;
  std::vector<Descriptor> descriptors;
  std::vector<float> depth;  ///< metres along the optical axis, 0: none

  std::size_t size() const { return keys.size(); }
  /// Indices of the features within radius (pixels) of a place, ascending by cell.
  std::vector<int> near(double u, double v, double radius) const;
  void index();  ///< builds the grid of near()

 private:
  static constexpr int kCell = 20;  // pixels
  int columns_ = 0, rows_ = 0;
  std::vector<std::vector<int>> cells_;
};

class Extractor {
 public:
  explicit Extractor(int count = 1000);
  /// Of an image as it is; pixel: where the pinhole has what the image has there. The depth is that
  /// of the pinhole.
  Features operator()(const cv::Mat1b& grey, const cv::Mat1f& depth,
                      const std::function<cv::Point2f(cv::Point2f)>& pixel = {}) const;

 private:
  int count_;
  cv::Ptr<cv::ORB> orb_, weak_;  // weak_: for images with little texture
};

}  // namespace slam_demo
