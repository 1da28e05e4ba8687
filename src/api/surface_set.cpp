// SPDX-License-Identifier: BSD-3-Clause
#include "gpureg/surface_set.hpp"

#include <algorithm>
#include <cmath>
#include <string>

#include "api/access.hpp"
#include "common/limits.hpp"
#include "common/shown.hpp"
#include "common/validate.hpp"
#include "math/trigonometry.hpp"
#include "pipeline/surface_matcher.hpp"

namespace gpureg {
namespace {

void check(const SurfaceView& surface, std::size_t number) {
  const std::string name = "surfaces[" + std::to_string(number) + "].";
  if (surface.size > limits::kMaxPoints)
    throw InvalidArgument(name + "size is " + std::to_string(surface.size) +
                          ", expected at most 2^31 - 1");
  if (surface.size == 0) return;
  if (surface.points == nullptr) throw InvalidArgument(name + "points is null");
  if (surface.normals == nullptr) throw InvalidArgument(name + "normals is null");
  for (std::size_t k = 0; surface.variances != nullptr && k < surface.size; ++k)
    if (!(surface.variances[k] >= 1) || !std::isfinite(surface.variances[k]))
      throw InvalidArgument(name + "variances[" + std::to_string(k) + "] is " +
                            shown(surface.variances[k]) + ", expected a finite number >= 1");
}

/// Measures the points that take part.
SurfaceArrays arrays_of(const SurfaceView& surface, const float* variances) {
  SurfaceArrays out{};
  out.points = surface.points;
  out.normals = surface.normals;
  out.variances = variances;
  out.size = static_cast<std::uint32_t>(surface.size);
  out.radius = 1;
  for (std::uint32_t k = 0; k < out.size; ++k) {
    const Vec3 p = row_of(out.points, k);
    if (!usable(p, row_of(out.normals, k))) continue;
    if (out.usable++ == 0) out.low = out.high = p;
    out.low = {std::min(out.low.x, p.x), std::min(out.low.y, p.y), std::min(out.low.z, p.z)};
    out.high = {std::max(out.high.x, p.x), std::max(out.high.y, p.y), std::max(out.high.z, p.z)};
  }
  out.centre = out.low * 0.5f + out.high * 0.5f;
  const float radius = norm(out.high * 0.5f - out.low * 0.5f);
  if (radius > limits::kMinLength) out.radius = radius;
  return out;
}

Rigid rigid_of(const UnalignedIsometry3d& pose) {
  Rigid out;
  for (int i = 0; i < 3; ++i) {
    for (int j = 0; j < 3; ++j) out.r[3 * i + j] = static_cast<float>(pose.linear()(i, j));
    out.t[i] = static_cast<float>(pose.translation()[i]);
  }
  return out;
}

/// From the units of the fixed-point sums to metres, and from turns about the moved centre to turns
/// about the origin: a centre at c moves by v + omega x c.
PointToPlaneSums in_metres(const SurfaceSums& sums, const SurfaceArrays& source, const Rigid& pose,
                           const SurfaceTerms& terms) {
  PointToPlaneSums out;
  const double unit = surface_step(source.size, terms.max_points) /
                      static_cast<double>(kIcpFixedScale),
               radius = static_cast<double>(source.radius),
               distance = static_cast<double>(terms.max_distance);
  Eigen::Matrix<double, 6, 6> a;
  Eigen::Matrix<double, 6, 1> g;
  const auto scale = [&](int k) { return k < 3 ? radius : 1.0; };
  int k = 0;
  for (int i = 0; i < 6; ++i)
    for (int j = 0; j <= i; ++j)
      a(i, j) = a(j, i) = static_cast<double>(sums.equations.v[k++]) * unit * scale(i) * scale(j);
  for (int i = 0; i < 6; ++i)
    g[i] = static_cast<double>(sums.equations.v[k++]) * unit * scale(i) * distance;
  const Vec3 c = apply(pose, source.centre);
  const double x = static_cast<double>(c.x), y = static_cast<double>(c.y),
               z = static_cast<double>(c.z);
  Eigen::Matrix<double, 6, 6> about_origin = Eigen::Matrix<double, 6, 6>::Identity();
  about_origin.bottomLeftCorner<3, 3>() << 0, z, -y, -z, 0, x, y, -x, 0;
  out.information = about_origin.transpose() * a * about_origin;
  out.gradient = about_origin.transpose() * g;
  out.count = static_cast<std::size_t>(sums.count);
  out.squared_distance =
      static_cast<double>(sums.squared) / static_cast<double>(kIcpFixedScale) * distance * distance;
  return out;
}

}  // namespace

void PointToPlaneOptions::validate() const {
  const auto length = [](double v) {
    return v >= static_cast<double>(limits::kMinLength) &&
           v <= static_cast<double>(limits::kMaxLength);
  };
  require(length(max_distance), "max_distance", max_distance, "1e-6 to 1e6");
  require(length(kernel_width), "kernel_width", kernel_width, "1e-6 to 1e6");
  require(max_normal_angle > 0 && max_normal_angle <= 90, "max_normal_angle", max_normal_angle,
          "(0, 90]");
  require(max_points >= 16, "max_points", max_points, "16 or more");
}

struct SurfaceSet::State {
  std::shared_ptr<Engine> engine;
  std::vector<float> equal_variances;  ///< of surfaces without variances
  std::vector<SurfaceArrays> surfaces;
  std::unique_ptr<SurfaceMatcher> matcher;  ///< last: it uses the others until its end
};

SurfaceSet::SurfaceSet(const Context& context, const std::vector<SurfaceView>& surfaces)
    : state_(std::make_unique<State>()) {
  state_->engine = Access::engine(context);
  std::size_t longest = 0;
  for (std::size_t k = 0; k < surfaces.size(); ++k) {
    check(surfaces[k], k);
    if (surfaces[k].variances == nullptr) longest = std::max(longest, surfaces[k].size);
  }
  state_->equal_variances.assign(longest, 1.0f);
  for (const SurfaceView& surface : surfaces)
    state_->surfaces.push_back(
        arrays_of(surface, surface.variances ? surface.variances : state_->equal_variances.data()));
  state_->matcher = state_->engine->match_surfaces(span_of(state_->surfaces));
}

SurfaceSet::~SurfaceSet() = default;
SurfaceSet::SurfaceSet(SurfaceSet&&) noexcept = default;
SurfaceSet& SurfaceSet::operator=(SurfaceSet&&) noexcept = default;

std::size_t SurfaceSet::size() const { return state_->surfaces.size(); }

std::vector<PointToPlaneSums> SurfaceSet::linearise(const std::vector<SurfacePair>& pairs,
                                                    const PointToPlaneOptions& options) const {
  options.validate();
  std::vector<SurfacePairInput> inputs;
  inputs.reserve(pairs.size());
  for (std::size_t p = 0; p < pairs.size(); ++p) {
    const auto check_index = [&](const char* name, std::uint32_t index) {
      if (index >= size())
        throw InvalidArgument("pairs[" + std::to_string(p) + "]." + name + " is " +
                              std::to_string(index) + ", the set has " + std::to_string(size()) +
                              " surfaces");
    };
    check_index("source", pairs[p].source);
    check_index("target", pairs[p].target);
    if (!pairs[p].target_from_source.matrix().allFinite())
      throw InvalidArgument("pairs[" + std::to_string(p) + "].target_from_source is not finite");
    inputs.push_back({pairs[p].source, pairs[p].target, rigid_of(pairs[p].target_from_source)});
  }
  const SurfaceTerms terms{
      static_cast<float>(options.max_distance), static_cast<float>(options.kernel_width),
      static_cast<float>(portable::cos(options.max_normal_angle * M_PI / 180)), options.max_points};
  std::vector<SurfaceSums> sums(pairs.size());
  state_->matcher->add_up(span_of(inputs), terms, {sums.data(), sums.size()});
  std::vector<PointToPlaneSums> out(pairs.size());
  for (std::size_t p = 0; p < pairs.size(); ++p)
    if (sums[p].count > 0)
      out[p] = in_metres(sums[p], state_->surfaces[pairs[p].source], inputs[p].target_from_source,
                         terms);
  return out;
}

}  // namespace gpureg
