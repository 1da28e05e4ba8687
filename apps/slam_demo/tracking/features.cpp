// SPDX-License-Identifier: BSD-3-Clause
#include "tracking/features.hpp"

#include <algorithm>
#include <cmath>
#include <cstring>

namespace slam_demo {
namespace {

/// Of all detections the strongest of each cell first, then the second ones, and so on.
std::vector<cv::KeyPoint> spread(std::vector<cv::KeyPoint> keys, const cv::Size& size, int count) {
  constexpr int kBucket = 40;  // pixels: about 200 buckets of a VGA image
  const int columns = size.width / kBucket + 1, rows = size.height / kBucket + 1;
  std::stable_sort(keys.begin(), keys.end(), [](const cv::KeyPoint& a, const cv::KeyPoint& b) {
    return a.response > b.response;
  });
  std::vector<std::vector<cv::KeyPoint>> buckets(static_cast<std::size_t>(columns * rows));
  for (const cv::KeyPoint& key : keys)
    buckets[static_cast<std::size_t>(static_cast<int>(key.pt.y) / kBucket * columns +
                                     static_cast<int>(key.pt.x) / kBucket)]
        .push_back(key);
  std::vector<cv::KeyPoint> chosen;
  for (std::size_t rank = 0; static_cast<int>(chosen.size()) < count; ++rank) {
    bool any = false;
    for (const auto& bucket : buckets) {
      if (rank >= bucket.size() || static_cast<int>(chosen.size()) >= count) continue;
      chosen.push_back(bucket[rank]);
      any = true;
    }
    if (!any) break;
  }
  return chosen;
}

/// The median of the valid depths around a pixel; 0 where they belong to several surfaces.
float depth_at(const cv::Mat1f& depth, const cv::Point2f& at) {
  constexpr float kMaxSpread = 0.08f;  // of the depth: a corner of a slanted surface stays
  const int u = cvRound(at.x), v = cvRound(at.y);
  std::array<float, 9> values;
  std::size_t count = 0;
  for (int y = std::max(0, v - 1); y <= std::min(depth.rows - 1, v + 1); ++y) {
    for (int x = std::max(0, u - 1); x <= std::min(depth.cols - 1, u + 1); ++x) {
      if (depth(y, x) > 0) values[count++] = depth(y, x);
    }
  }
  if (count < 3) return 0;
  std::sort(values.begin(), values.begin() + static_cast<std::ptrdiff_t>(count));
  const float median = values[count / 2];
  return values[count - 1] - values[0] > kMaxSpread * median ? 0 : median;
}

}  // namespace

int hamming(const Descriptor& a, const Descriptor& b) {
  int distance = 0;
  for (std::size_t k = 0; k < a.size(); ++k) distance += __builtin_popcountll(a[k] ^ b[k]);
  return distance;
}

double scale_of(int octave) { return std::pow(kScaleFactor, octave); }

void Features::index() {
  // A lens may put features outside the image.
  const auto cell_of = [](float x) { return std::max(0, static_cast<int>(x)) / kCell; };
  columns_ = rows_ = 1;
  for (const cv::KeyPoint& key : keys) {
    columns_ = std::max(columns_, static_cast<int>(key.pt.x) / kCell + 1);
    rows_ = std::max(rows_, static_cast<int>(key.pt.y) / kCell + 1);
  }
  cells_.assign(static_cast<std::size_t>(columns_ * rows_), {});
  for (std::size_t k = 0; k < keys.size(); ++k)
    cells_[static_cast<std::size_t>(cell_of(keys[k].pt.y) * columns_ + cell_of(keys[k].pt.x))]
        .push_back(static_cast<int>(k));
}

std::vector<int> Features::near(double u, double v, double radius) const {
  std::vector<int> result;
  const auto cell = [](double x, int count) {
    return std::clamp(static_cast<int>(std::floor(x / kCell)), 0, count - 1);
  };
  for (int y = cell(v - radius, rows_); y <= cell(v + radius, rows_); ++y) {
    for (int x = cell(u - radius, columns_); x <= cell(u + radius, columns_); ++x) {
      for (const int k : cells_[static_cast<std::size_t>(y * columns_ + x)]) {
        const cv::Point2f& at = keys[static_cast<std::size_t>(k)].pt;
        if (std::hypot(at.x - u, at.y - v) <= radius) result.push_back(k);
      }
    }
  }
  return result;
}

Extractor::Extractor(int count) : count_(count) {
  const auto orb = [&](int threshold) {
    return cv::ORB::create(3 * count, static_cast<float>(kScaleFactor), kLevels, 19, 0, 2,
                           cv::ORB::HARRIS_SCORE, 31, threshold);
  };
  orb_ = orb(12);
  weak_ = orb(6);
}

Features Extractor::operator()(const cv::Mat1b& grey, const cv::Mat1f& depth,
                               const std::function<cv::Point2f(cv::Point2f)>& pixel) const {
  Features result;
  std::vector<cv::KeyPoint> keys;
  if (grey.empty()) {
    result.index();
    return result;
  }
  orb_->detect(grey, keys);
  if (static_cast<int>(keys.size()) < count_ / 2) weak_->detect(grey, keys);
  result.keys = spread(std::move(keys), grey.size(), count_);
  cv::Mat descriptors;
  orb_->compute(grey, result.keys, descriptors);
  result.descriptors.resize(result.keys.size());
  for (std::size_t k = 0; k < result.keys.size(); ++k) {
    std::memcpy(result.descriptors[k].data(), descriptors.ptr(static_cast<int>(k)), 32);
    if (pixel) result.keys[k].pt = pixel(result.keys[k].pt);
    result.depth.push_back(depth_at(depth, result.keys[k].pt));
  }
  result.index();
  return result;
}

}  // namespace slam_demo
