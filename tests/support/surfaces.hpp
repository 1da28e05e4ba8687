// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Geometry>
#include <cstring>
#include <random>
#include <vector>

#include "gpureg/surface_set.hpp"
#include "support/scan.hpp"

namespace gpureg::test {

struct TestSurface {
  std::vector<Eigen::Vector3f> points, normals;
  std::vector<float> variances;

  void add(const Eigen::Vector3f& point, const Eigen::Vector3f& normal, float variance = 1) {
    points.push_back(point);
    normals.push_back(normal);
    variances.push_back(variance);
  }
  SurfaceView view() const {
    if (points.empty()) return {};
    return {points[0].data(), normals[0].data(), variances.data(), points.size()};
  }
};

/// Random samples of a bent sheet and a wall in frames of their own, and all ordered pairs at poses
/// that are a centimetre off.
struct SurfaceScene {
  std::vector<TestSurface> surfaces;
  std::vector<SurfacePair> pairs;

  SurfaceScene(std::uint32_t count, int points, unsigned seed = 7) {
    std::mt19937 random(seed);
    std::uniform_real_distribution<float> unit(-1, 1);
    std::normal_distribution<float> noise(0, 0.01f);
    std::vector<Eigen::Isometry3d> frame;
    for (std::uint32_t s = 0; s < count; ++s) {
      frame.push_back(random_pose(random));
      surfaces.emplace_back();
      for (int k = 0; k < points; ++k) {
        const float u = unit(random), v = unit(random);
        Eigen::Vector3f p(u, v, 0.3f * u * u), n(-0.6f * u, 0, 1);
        if (k % 3 == 0) {
          p = {1.2f, u, v};
          n = {-1, 0, 0};
        }
        n.normalize();
        p += noise(random) * n;
        const Eigen::Isometry3d to = frame.back().inverse();
        surfaces.back().add((to * p.cast<double>()).cast<float>(),
                            (to.linear() * n.cast<double>()).cast<float>(),
                            1.5f + unit(random) / 2);
      }
    }
    for (std::uint32_t i = 0; i < count; ++i)
      for (std::uint32_t j = 0; j < count; ++j)
        if (i != j) {
          Eigen::Isometry3d pose = frame[j].inverse() * frame[i];
          pose.pretranslate(Eigen::Vector3d(0.01, -0.01, 0.005));
          pairs.push_back({i, j, UnalignedIsometry3d(pose.matrix())});
        }
  }

  std::vector<SurfaceView> views() const {
    std::vector<SurfaceView> out;
    for (const TestSurface& surface : surfaces) out.push_back(surface.view());
    return out;
  }
};

inline bool same_bits(const PointToPlaneSums& a, const PointToPlaneSums& b) {
  return a.count == b.count &&
         std::memcmp(&a.squared_distance, &b.squared_distance, sizeof(double)) == 0 &&
         std::memcmp(a.information.data(), b.information.data(), 36 * sizeof(double)) == 0 &&
         std::memcmp(a.gradient.data(), b.gradient.data(), 6 * sizeof(double)) == 0;
}

}  // namespace gpureg::test
