// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Geometry>
#include <algorithm>
#include <string>

#include "fields/options.hpp"
#include "fuzz/bytes.hpp"
#include "gpureg/registration.hpp"

/// Clouds, poses and options made of bytes.
namespace gpureg::fuzz {

/// Up to 96 points on a bent sheet, which give features and poses, or anywhere.
inline PointCloud cloud_of(Bytes& bytes) {
  PointCloud cloud;
  const std::uint32_t size = bytes.below(97), shape = bytes.below(3);
  const float scale = bytes.flag() ? 0.5f : bytes.number(3.0f);
  for (std::uint32_t k = 0; k < size; ++k) {
    Eigen::Vector3f p(static_cast<float>(k % 10) * 0.1f, static_cast<float>(k / 10) * 0.1f, 0);
    p.z() = p.x() * p.y() - 0.3f * p.x();
    if (shape > 0)
      for (int axis = 0; axis < 3; ++axis) p[axis] += bytes.number(shape == 1 ? 0.02f : 2.0f);
    cloud.points.push_back(p * (scale * 2));
  }
  if (bytes.flag())
    for (std::uint32_t k = 0; k < size; ++k)
      cloud.normals.emplace_back(bytes.number(1), bytes.number(1), 1);
  for (std::uint32_t k = bytes.below(3); k > 0; --k)
    cloud.viewpoints.emplace_back(bytes.number(2), bytes.number(2), bytes.number(4));
  return cloud;
}

/// One in eight fields becomes a value around its range; what would take long stays small.
template <typename T>
void vary(Bytes& bytes, T& options) {
  constexpr double kMostLength = 2, kMostNumber = 1000, kMostCount = 300;
  fields::each<T>([&](const std::string&, auto member, const fields::Field& field) {
    auto& value = options.*member;
    using M = std::decay_t<decltype(value)>;
    if constexpr (fields::is_described<M>)
      vary(bytes, value);
    else if constexpr (std::is_same_v<M, bool>)
      value = bytes.flag();
    else if constexpr (std::is_floating_point_v<M>) {
      const double high = field.range.high > kMostNumber ? kMostLength : field.range.high;
      if (bytes.below(8) == 0) value = bytes.number(static_cast<float>(high * 1.25));
    } else if constexpr (std::is_same_v<M, std::uint32_t>) {
      if (bytes.below(8) == 0)
        value = bytes.below(static_cast<std::uint32_t>(std::min(field.range.high + 2, kMostCount)));
    }
  });
}

inline RegistrationOptions options_of(Bytes& bytes) {
  RegistrationOptions o =
      bytes.flag() ? RegistrationOptions::loopsmart(0.1f) : RegistrationOptions{0.1f};
  o.quadruples = 256;
  o.seed = bytes.take<std::uint8_t>();
  vary(bytes, o);
  return o;
}

inline UnalignedIsometry3d pose_of(Bytes& bytes, float most) {
  UnalignedIsometry3d out = UnalignedIsometry3d::Identity();
  const auto turn = [&] { return static_cast<double>(bytes.number(2)); };
  const double x = turn(), y = turn(), z = turn();
  out.linear() = Eigen::Quaterniond(1, x, y, z).normalized().toRotationMatrix();
  for (int k = 0; k < 3; ++k) out.translation()[k] = static_cast<double>(bytes.number(most));
  return out;
}

}  // namespace gpureg::fuzz
