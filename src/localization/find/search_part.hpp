// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "api/with_settings.hpp"

namespace gpureg::localization {

/// A pose that alignments of the part with pieces of the scene ended in.
struct PartCandidate {
  UnalignedIsometry3d scene_from_part = no_pose();
  double confidence = 0;    ///< of the best of these alignments
  std::uint32_t votes = 1;  ///< how many there were
};

/// What the pieces of a scene are cut from.
struct SearchedScene {
  std::vector<Eigen::Vector3f> points, normals;  ///< means of voxels
  std::vector<Eigen::Vector3f> viewpoints;       ///< empty: not known
  Eigen::Vector3d origin{0, 0, 0};
  bool oriented = false;  ///< normals are of the side that was seen
};

struct PieceSizes {
  double radius = 0;    ///< of a piece
  double distance = 0;  ///< of their middles, on the surface
};

/// Middles of pieces that together cover the surface: indices of points.
std::vector<std::uint32_t> middles_of_pieces(const std::vector<Eigen::Vector3f>& points,
                                             double distance);

/// Aligns the part with all pieces.
/// @param pieces their number, for the result.
std::vector<PartCandidate> search_pieces(const Context& context, const PreparedCloud& part,
                                         const SearchedScene& scene, const PieceSizes& sizes,
                                         const RegistrationSettings& options, std::size_t& pieces);

}  // namespace gpureg::localization
