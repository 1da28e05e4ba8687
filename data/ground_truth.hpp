// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Geometry>
#include <string>
#include <vector>

namespace gpureg::synthetic {

/// A fused piece of the scan and its exact place.
struct Fragment {
  std::vector<Eigen::Vector3f> points;  ///< metres, in the fragment's frame
  Eigen::Isometry3d world_from_fragment = Eigen::Isometry3d::Identity();
};

/// Tells whether a cloud has a point within a fixed radius of a query. Read-only after
/// construction: thread-safe.
class NeighbourGrid {
 public:
  NeighbourGrid(const std::vector<Eigen::Vector3f>& points, float radius);
  bool any_within_radius(const Eigen::Vector3f& query) const;

 private:
  float radius_, inverse_cell_;
  Eigen::Vector3f low_;
  Eigen::Vector3i size_;
  std::vector<std::uint32_t> start_;     // of each cell, in points_
  std::vector<Eigen::Vector3f> points_;  // by cell
};

constexpr float kOverlapRadius = 0.075f;     ///< metres
constexpr double kGroundTruthOverlap = 0.3;  ///< gt.log, Redwood's guideline
constexpr double kAnyOverlap = 0.05;         ///< gt_all.log

/// How two fragments i < j overlap.
struct PairTruth {
  int i = 0, j = 0;
  Eigen::Matrix4d i_from_j = Eigen::Matrix4d::Identity();
  double share_of_i = 0,
         share_of_j = 0;  ///< points of one with a point of the other within kOverlapRadius
  Eigen::Matrix<double, 6, 6> information =
      Eigen::Matrix<double, 6, 6>::Zero();  ///< Redwood's, over the corresponding points of j

  double overlap() const { return std::max(share_of_i, share_of_j); }
};

PairTruth pair_truth(const std::vector<Fragment>& fragments,
                     const std::vector<NeighbourGrid>& grids, int i, int j);

/// gt.log, gt.info, gt_all.log, gt_all.info and gt_overlap.txt. truths: all pairs in order. gt.log
/// goes last: its presence says that the scene is complete. Throws IoError.
void write_ground_truth(const std::string& folder, int fragments,
                        const std::vector<PairTruth>& truths);

}  // namespace gpureg::synthetic
