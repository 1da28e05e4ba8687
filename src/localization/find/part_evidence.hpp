// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "gpureg/localization/find.hpp"
#include "localization/find/part_surface.hpp"
#include "localization/find/scene_surface.hpp"

namespace gpureg::localization {

/// Moves rows of the part to rows of the scene.
using RowPose = Eigen::Isometry3d;

/// Evidence of poses of one part in one scene.
class PartVerifier {
 public:
  /// @param views one per viewpoint; none: not known from where the scene was seen.
  /// @param voxel of the evidence: spacing of both surfaces.
  PartVerifier(const PartSurface& part, const SceneSurface& scene,
               const std::vector<SceneView>& views, float voxel);

  struct Verdict {
    PartEvidence evidence;
    std::vector<std::uint32_t> claimed;  ///< blocks of the scene that the part explains; ascending
  };
  /// Thread-safe.
  Verdict verify(const RowPose& pose) const;

  /// Point-to-plane ICP of the part's surface in view. Thread-safe.
  RowPose refined(const RowPose& pose) const;

  /// RMS distance between the part at two poses.
  double displacement(const RowPose& a, const RowPose& b) const;

 private:
  struct Image;
  struct Sums;
  bool draw(const RowPose& pose, const SceneView& view, Image& image) const;
  Verdict verify_in(const RowPose& pose, const SceneView& view) const;
  Verdict verify_unseen(const RowPose& pose) const;
  /// Numbers of the part's points in view.
  std::vector<std::uint32_t> in_view(const RowPose& pose) const;

  const PartSurface& part_;
  const SceneSurface& scene_;
  const std::vector<SceneView>& views_;
  float voxel_;
  Eigen::Matrix3d spread_ = Eigen::Matrix3d::Zero();  ///< of the part's points about their mean
  Eigen::Vector3d mean_ = Eigen::Vector3d::Zero();
};

}  // namespace gpureg::localization
