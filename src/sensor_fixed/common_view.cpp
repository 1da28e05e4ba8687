// SPDX-License-Identifier: BSD-3-Clause
#include "sensor_fixed/common_view.hpp"

#include "algorithm/evidence.hpp"
#include "math/rigid.hpp"

namespace gpureg {
namespace {

/// Halves of a scan, with noise, differ in 0.00 (rooms) to 0.02 (LiDAR) of what both observed;
/// poses at the identity of different scans, held by points fixed to the sensor, in 0.38 to 0.52,
/// even in a corridor along which the walls slide.
constexpr double kMostDifferent = 1.0 / 3;
/// Where less is observed by both, their fields of view tell nothing.
constexpr double kLeastObserved = 0.1;

bool has_sensor(const PreparedState& cloud) {
  const ViewpointSource source = cloud.statistics.viewpoint;
  return cloud.viewpoints.size() == 1 &&
         (source == ViewpointSource::given || source == ViewpointSource::origin);
}

}  // namespace

bool contradicts_common_view(const ModeOutcome& mode, const PreparedState& moved,
                             const PreparedState& fixed, double distance) {
  if (!has_sensor(moved) || !has_sensor(fixed)) return false;
  const Vec3 from = apply(to_rigid(mode.pose), moved.viewpoints.front());
  if (!(static_cast<double>(norm(from - fixed.viewpoints.front())) <= distance)) return false;
  const auto both = [&](Term term) {
    return static_cast<double>(mode.source[term] + mode.target[term]);
  };
  const double observed = both(Term::observed),
               different = both(Term::violating) + both(Term::occluded);
  return observed >= kLeastObserved * both(Term::tested) && different > kMostDifferent * observed;
}

}  // namespace gpureg
