// SPDX-License-Identifier: BSD-3-Clause
#include "api/prior.hpp"

#include <cmath>

#include "api/frames.hpp"
#include "common/coordinates.hpp"
#include "common/rigid.hpp"
#include "common/validate.hpp"
#include "flat/planar_pose.hpp"
#include "math/trigonometry.hpp"

namespace gpureg {
namespace {

/// Widens the limits by the rounding of directions and poses to float: poses exactly at a limit
/// must pass.
constexpr double kRounding = 1e-6;
/// Largest angle between the planes of 2-D scans before the pose is made planar, degrees: layers of
/// half a metre hold the tilt of a candidate loosely.
constexpr double kMostTilt = 25;
/// Shortest direction, far above the rounding of its components.
constexpr double kMinNorm = 1e-9;

void require_direction(const Eigen::Vector3d& v, const std::string& name) {
  const std::string field = name + ".norm";
  // The square of a longer one is infinite.
  require(v.norm() > kMinNorm && v.norm() <= limits::kMaxCoordinate, field.c_str(), v.norm(),
          "a direction: finite, and not of length 0");
}

void require_degrees(double degrees, const std::string& name) {
  require(std::isfinite(degrees) && degrees > 0 && degrees <= 180, name.c_str(), degrees,
          "degrees in (0, 180]");
}

Vec3 to_vec3(const Eigen::Vector3d& v) {
  return {static_cast<float>(v.x()), static_cast<float>(v.y()), static_cast<float>(v.z())};
}

}  // namespace

void RegistrationPrior::validate(const std::string& name) const {
  if (gravity) {
    require_direction(gravity->source_up, name + ".gravity.source_up");
    require_direction(gravity->target_up, name + ".gravity.target_up");
    require_degrees(gravity->max_angle, name + ".gravity.max_angle");
  }
  if (!pose) return;
  require_rigid(pose->target_from_source, name + ".pose.target_from_source");
  require_degrees(pose->max_rotation, name + ".pose.max_rotation");
  const std::string field = name + ".pose.max_translation";
  require(std::isfinite(pose->max_translation) && pose->max_translation > 0, field.c_str(),
          pose->max_translation, "a length > 0");
}

PriorTest prior_test(const RegistrationPrior& prior, const PreparedState& source,
                     const PreparedState& target, bool swapped) {
  PriorTest out;
  out.swapped = swapped;
  std::optional<GravityPrior> gravity = prior.gravity;
  if (!gravity && planar_pair(source, target))
    gravity = GravityPrior{normal_of(source.plane), normal_of(target.plane), kMostTilt};
  if (gravity) {
    out.gravity = true;
    const Eigen::Vector3d s = gravity->source_up.normalized(), t = gravity->target_up.normalized();
    out.moved_up = to_vec3(swapped ? t : s);
    out.fixed_up = to_vec3(swapped ? s : t);
    out.min_up_cosine = static_cast<float>(
        portable::cos(gravity->max_angle * portable::kRadiansPerDegree) - kRounding);
  }
  if (prior.pose) {
    out.pose = true;
    // p_target = R p_source + t, with points relative to both local origins.
    Eigen::Isometry3d local = Eigen::Isometry3d::Identity();
    local.linear() = prior.pose->target_from_source.linear();
    const Eigen::Vector3d from_source = prior.pose->target_from_source * offset_of(source);
    local.translation() = prior.pose->target_from_source.linear() * origin_of(source) +
                          (from_source - offset_of(target)) - origin_of(target);
    if (swapped) local = local.inverse();
    for (int row = 0; row < 3; ++row) {
      for (int column = 0; column < 3; ++column)
        out.expected.r[3 * row + column] = static_cast<float>(local.linear()(row, column));
      out.expected.t[row] = static_cast<float>(local.translation()[row]);
    }
    out.min_trace = static_cast<float>(
        1.0 + 2.0 * portable::cos(prior.pose->max_rotation * portable::kRadiansPerDegree) -
        kRounding);
    out.max_squared_distance = static_cast<float>(prior.pose->max_translation *
                                                  prior.pose->max_translation * (1.0 + kRounding));
  }
  return out;
}

}  // namespace gpureg
