// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <vector>

#include "gpureg/reconstruction.hpp"

namespace gpureg::reconstruction {

/// p to scale * rotation * p + translation.
struct Similarity {
  double scale = 1;
  UnalignedIsometry3d rigid = UnalignedIsometry3d::Identity();  ///< rotation and translation

  Eigen::Vector3d operator*(const Eigen::Vector3d& p) const {
    return scale * (rigid.linear() * p) + rigid.translation();
  }
};

/// An accepted edge with a free scale. At the centre of the overlap the scale moves nothing.
struct SimilarityEdge {
  std::size_t source = 0, target = 0;
  UnalignedIsometry3d target_from_source = UnalignedIsometry3d::Identity();
  double log_scale = 0;                              ///< of the source to the target
  Eigen::Vector3d centre = Eigen::Vector3d::Zero();  ///< in the source's frame
  pose_graph::UnalignedMatrix6d information;         ///< of the pose: pose_graph::Edge
  double scale_information = 0;                      ///< of log_scale
};

/// Moves the nodes to the least squares of all edges by Gauss-Newton with a sparse factorisation
/// (Strasdat et al. 2010, Scale Drift-Aware Large Scale Monocular SLAM). Nodes that are held, and
/// those without an edge, keep theirs; every other one must be connected to a held one.
/// @return false where the equations could not be solved; the nodes are then as given.
bool solve_similarities(const std::vector<SimilarityEdge>& edges, const std::vector<char>& held,
                        std::vector<Similarity>& world_from_node);

}  // namespace gpureg::reconstruction
