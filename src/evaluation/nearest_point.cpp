// SPDX-License-Identifier: BSD-3-Clause
#include "evaluation/nearest_point.hpp"

#include <algorithm>
#include <limits>
#include <numeric>

namespace gpureg::evaluation {

NearestPoint::NearestPoint(const std::vector<Eigen::Vector3f>& points)
    : points_(points), order_(points.size()), axis_(points.size(), 0) {
  std::iota(order_.begin(), order_.end(), std::size_t{0});
  split(0, order_.size());
}

void NearestPoint::split(std::size_t begin, std::size_t end) {
  if (end - begin < 2) return;
  Eigen::Vector3f low = points_[order_[begin]], high = low;
  for (std::size_t k = begin; k < end; ++k) {
    low = low.cwiseMin(points_[order_[k]]);
    high = high.cwiseMax(points_[order_[k]]);
  }
  int axis = 0;
  (high - low).maxCoeff(&axis);
  const std::size_t middle = begin + (end - begin) / 2;
  const auto at = [&](std::size_t k) { return order_.begin() + static_cast<std::ptrdiff_t>(k); };
  std::nth_element(at(begin), at(middle), at(end), [&](std::size_t a, std::size_t b) {
    const float x = points_[a][axis], y = points_[b][axis];
    return x != y ? x < y : a < b;
  });
  axis_[middle] = static_cast<unsigned char>(axis);
  split(begin, middle);
  split(middle + 1, end);
}

std::size_t NearestPoint::operator()(const Eigen::Vector3f& place) const {
  Best best{std::numeric_limits<float>::infinity(), order_.front()};
  search(place, 0, order_.size(), best);
  return best.index;
}

void NearestPoint::search(const Eigen::Vector3f& place, std::size_t begin, std::size_t end,
                          Best& best) const {
  if (begin == end) return;
  const std::size_t middle = begin + (end - begin) / 2, index = order_[middle];
  const float squared = (points_[index] - place).squaredNorm();
  if (squared < best.squared) best = {squared, index};
  const float beside = place[axis_[middle]] - points_[index][axis_[middle]];
  if (beside < 0)
    search(place, begin, middle, best);
  else
    search(place, middle + 1, end, best);
  if (beside * beside >= best.squared) return;
  if (beside < 0)
    search(place, middle + 1, end, best);
  else
    search(place, begin, middle, best);
}

}  // namespace gpureg::evaluation
