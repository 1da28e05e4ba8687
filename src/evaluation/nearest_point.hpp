// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <vector>

namespace gpureg::evaluation {

/// Nearest of many points: a k-d tree without pointers. The middle of every range of the order is
/// its node; the ranges on both sides are its subtrees. Thread-safe after construction.
class NearestPoint {
 public:
  /// points: finite, at least one; they must outlive the tree.
  explicit NearestPoint(const std::vector<Eigen::Vector3f>& points);

  /// Index of the point nearest to a place; of equally near ones any, always the same.
  std::size_t operator()(const Eigen::Vector3f& place) const;

 private:
  struct Best {
    float squared;
    std::size_t index;
  };
  void split(std::size_t begin, std::size_t end);
  void search(const Eigen::Vector3f& place, std::size_t begin, std::size_t end, Best& best) const;

  const std::vector<Eigen::Vector3f>& points_;
  std::vector<std::size_t> order_;
  std::vector<unsigned char> axis_;  // of the node at a place of the order
};

}  // namespace gpureg::evaluation
