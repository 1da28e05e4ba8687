// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "cuda/common/closest_cells.cuh"
#include "cuda/compatibility/lane_evidence.cuh"

namespace gpureg::cuda {

/// Result of comparing one point.
struct ComparedWith {
  FoundPoint closest;
  bool inlier;
};

/// verify_point() with the tables of the other cloud.
__device__ inline ComparedWith compare_point(const CloudView& moved, const CloudView& other,
                                             const CellSummaries& cells, const Rigid& pose,
                                             const EvidenceTest& test, std::uint32_t maps,
                                             std::uint32_t i, LaneEvidence& e) {
  const Vec3 q = apply(pose, moved.points[i]), normal = rotate(pose, moved.normals[i]);
  const FoundPoint c = find_point(other, cells, q, test.inlier.max_squared);
  const bool hit = c.found(),
             inlier = hit && c.agrees(other, cells, normal, test.inlier.min_cosine);
  add_evidence({q, normal, hit, inlier, c.squared_distance, moved.normal_weight[i],
                observe_point(other.visibility, maps, q, normal, test)},
               other, test, e);
  return {c, inlier};
}

}  // namespace gpureg::cuda
