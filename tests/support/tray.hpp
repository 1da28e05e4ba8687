// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Geometry>
#include <cmath>
#include <limits>
#include <random>
#include <vector>

#include "gpureg/point_cloud.hpp"

/// A tray of parts of boxes as a depth camera sees it.
namespace gpureg::test::tray {

/// Axis-parallel in a frame of its own.
struct Box {
  Eigen::Vector3d middle, half;
};

/// Boxes that move together.
struct Body {
  std::vector<Box> boxes;
  Eigen::Isometry3d pose = Eigen::Isometry3d::Identity();

  double hit(const Eigen::Vector3d& eye, const Eigen::Vector3d& ray) const {
    const Eigen::Vector3d o = pose.inverse() * eye, d = pose.linear().transpose() * ray;
    double first = std::numeric_limits<double>::infinity();
    for (const Box& box : boxes) {
      double near = 0, far = first;
      for (int k = 0; k < 3; ++k) {
        const double a = (box.middle[k] - box.half[k] - o[k]) / d[k],
                     b = (box.middle[k] + box.half[k] - o[k]) / d[k];
        near = std::max(near, std::min(a, b));
        far = std::min(far, std::max(a, b));
      }
      if (near > 0 && near < far) first = near;
    }
    return first;
  }
};

/// A base, a wall at its end and a post, 8 cm long.
inline std::vector<Box> stepped() {
  return {{{0, 0, .01}, {.04, .025, .01}},
          {{-.03, 0, .035}, {.01, .025, .015}},
          {{.02, .01, .035}, {.009, .009, .015}}};
}

/// Points on the boxes' faces, also on those inside other boxes, as CAD files have them.
inline PointCloud model_of(const std::vector<Box>& boxes) {
  PointCloud cloud;
  cloud.model = true;
  std::mt19937 random(1);
  const auto uniform = [&] { return static_cast<double>(random()) / 2147483648.0 - 1; };
  for (const Box& box : boxes)
    for (int k = 0; k < 6000; ++k) {
      const int axis = k % 3;
      const double side = k % 2 == 0 ? 1 : -1;
      Eigen::Vector3d at(uniform(), uniform(), uniform());
      at[axis] = side;
      cloud.points.push_back((box.middle + box.half.cwiseProduct(at)).cast<float>());
      cloud.normals.push_back((side * Eigen::Vector3d::Unit(axis)).cast<float>());
    }
  return cloud;
}

inline Eigen::Isometry3d placed(double turn, double tilt, const Eigen::Vector3d& at) {
  Eigen::Isometry3d pose = Eigen::Isometry3d::Identity();
  pose.linear() = (Eigen::AngleAxisd(turn, Eigen::Vector3d::UnitZ()) *
                   Eigen::AngleAxisd(tilt, Eigen::Vector3d::UnitX()))
                      .toRotationMatrix();
  pose.translation() = at;
  return pose;
}

inline Eigen::Isometry3d camera_from_world() {
  Eigen::Isometry3d world_from_camera = Eigen::Isometry3d::Identity();
  world_from_camera.linear() =
      Eigen::AngleAxisd(M_PI + .2, Eigen::Vector3d::UnitX()).toRotationMatrix();
  world_from_camera.translation() = Eigen::Vector3d(0, -.1, .5);
  return world_from_camera.inverse();
}

/// A tray with bodies in it as a depth camera sees it from above, noise 0.4 mm.
inline PointCloud scene_of(const std::vector<Body>& bodies) {
  std::vector<Body> all = bodies;
  all.push_back({{{{0, 0, -.01}, {.16, .12, .01}},
                  {{0, .12, .02}, {.16, .005, .04}},
                  {{0, -.12, .02}, {.16, .005, .04}}}});
  const Eigen::Isometry3d camera = camera_from_world(), world = camera.inverse();
  std::mt19937 random(2);
  std::normal_distribution<double> noise(0, 0.0004);
  PointCloud cloud;
  cloud.viewpoints = {Eigen::Vector3f::Zero()};
  for (int v = -90; v < 90; ++v)
    for (int u = -120; u < 120; ++u) {
      const Eigen::Vector3d ray = Eigen::Vector3d(u + .5, v + .5, 300).normalized();
      double range = std::numeric_limits<double>::infinity();
      for (const Body& body : all)
        range = std::min(range, body.hit(world.translation(), world.linear() * ray));
      if (std::isfinite(range))
        cloud.points.push_back((ray * (range + noise(random))).cast<float>());
    }
  return cloud;
}

inline std::vector<Body> three_parts() {
  return {{stepped(), placed(.4, 0, {-.1, .04, 0})},
          {stepped(), placed(2.3, 0, {.09, .05, 0})},
          {stepped(), placed(-1.2, M_PI / 2, {.02, -.06, .026})}};
}

/// Something else of boxes.
inline Body clutter(double turn, const Eigen::Vector3d& at) {
  return {{{{0, 0, .02}, {.02, .015, .02}}, {{.02, .02, .01}, {.03, .01, .01}}},
          placed(turn, 0, at)};
}

}  // namespace gpureg::test::tray
