// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <memory>
#include <vector>

#include "gpureg/registration/scale.hpp"
#include "pipeline/prepared_state.hpp"
#include "scale/ladder.hpp"
#include "scale/prepared_surface.hpp"
#include "settings/settings.hpp"

namespace gpureg::scale {

/// Options of the preparation for the search of scales: with more than kMostTargetPoints points of
/// the target, all lengths are longer by a power of 1.5.
constexpr std::size_t kMostTargetPoints = 12'000;
PrepareSettings search_options(const PreparedCloud& target, const RegistrationSettings& options);

/// A source at the rungs of the ladder.
class PreparedLadder {
 public:
  /// options: search_options() of the targets.
  PreparedLadder(const Context& context, const PointCloudView& source, const ScaleRange& range,
                 const PrepareSettings& options);

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
  PrepareSettings search;   ///< see search_options()
  PreparedCloud coarse;     ///< prepared with them
  PointsAndNormals points;  ///< of coarse
  PreparedSurface surface;  ///< of cloud

  PreparedTarget(const Context& context, const PointCloudView& target,
                 const RegistrationSettings& options);
};

/// Scales that the matches of the rungs agree on, the best-supported first. The ladder is one of
/// the search options of the target.
std::vector<double> propose_scales(const Context& context, const PreparedLadder& source,
                                   const PreparedTarget& target, const ScaleRange& range,
                                   const RegistrationSettings& options);

/// The pair at the most confident scale.
ScaledResult search_scale(const Context& context, const PreparedLadder& source,
                          const PreparedTarget& target, const ScaleRange& range,
                          const RegistrationSettings& options);

}  // namespace gpureg::scale
