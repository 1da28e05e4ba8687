// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "gpureg/prepared_cloud.hpp"
#include "scale/refine.hpp"

namespace gpureg::scale {

/// The surface of a prepared cloud, for any number of refinements.
class PreparedSurface {
 public:
  /// @param distance largest one that is searched.
  PreparedSurface(const PreparedCloud& cloud, float distance);

  const PreparedCloud& cloud() const { return cloud_; }
  const ClosestSurface& surface() const { return surface_; }

 private:
  PreparedCloud cloud_;
  ClosestSurface surface_;
};

/// refine_scale() of two prepared clouds.
/// @param target_from_source between the clouds' frames.
RefinedScale refine_scale(const PreparedSurface& source, const PreparedSurface& target,
                          const UnalignedIsometry3d& target_from_source, float kernel);

}  // namespace gpureg::scale
