// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <memory>
#include <vector>

#include "pipeline/engine.hpp"
#include "viewpoint/viewpoint_inference.hpp"

namespace gpureg {

/// A prepared cloud whose sides turned out to be others than its preparation took.
struct TurnedCloud {
  std::shared_ptr<PreparedState>& state;
  PreparedFacts before;
  const PointsAndNormals& surface;
  std::vector<std::vector<Vec3>> normals;  ///< with the right sides; with both if both are likely
  std::vector<float> features;             ///< of the caller, or none
  bool matched_only;

  /// The prepared points as input of a preparation that keeps their sides.
  RawCloud raw(std::size_t side) const;
};

/// Drops the data of the prepared cloud: of a large one it takes gigabytes.
/// @param surface outlives the result.
TurnedCloud turn(std::shared_ptr<PreparedState>& state, const PointsAndNormals& surface,
                 const InferredSides& sides, bool own_features, bool matched_only);

/// Prepares turned clouds again from their prepared points, with the right sides as input normals
/// and no viewpoint, and once more with the other sides where both are likely.
/// The first preparation cannot simply go on from its normals: until the sides are known, which the
/// host decides meanwhile, it has taken those of the input or the origin.
void prepare_again(Engine& engine, const PrepareSettings& options,
                   std::vector<TurnedCloud>& turned);

}  // namespace gpureg
