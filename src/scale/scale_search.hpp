// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <memory>
#include <vector>

#include "gpureg/scale.hpp"
#include "pipeline/prepared_state.hpp"
#include "scale/ladder.hpp"
#include "scale/refine.hpp"

namespace gpureg::scale {

/// A source at the rungs of the ladder.
class PreparedLadder {
 public:
  PreparedLadder(const Context& context, const PointCloudView& source, const ScaleRange& range,
                 const RegistrationOptions& options);

  struct Rung {
    double scale;
    PreparedCloud cloud;
    PointsAndNormals points;
  };
  const std::vector<Rung>& rungs() const { return rungs_; }
  const PointCloudView& source() const { return source_; }

 private:
  PointCloudView source_;
  std::vector<Rung> rungs_;
};

/// A target for any number of ladders.
struct PreparedTarget {
  PreparedCloud cloud;
  PointsAndNormals points;
  ClosestSurface surface;

  PreparedTarget(const PreparedCloud& prepared, const RegistrationOptions& options);
};

/// Scales that the matches of the rungs agree on, the best-supported first.
std::vector<double> propose_scales(const Context& context, const PreparedLadder& source,
                                   const PreparedTarget& target, const ScaleRange& range,
                                   const RegistrationOptions& options);

/// The pair at the most confident scale.
ScaledResult search_scale(const Context& context, const PreparedLadder& source,
                          const PreparedTarget& target, const ScaleRange& range,
                          const RegistrationOptions& options);

}  // namespace gpureg::scale
