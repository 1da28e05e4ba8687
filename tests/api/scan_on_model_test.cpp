// SPDX-License-Identifier: BSD-3-Clause
// A sweep of a street lies on the block model of the street at the right height, although the
// ground touches the model from either side.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "gpureg/registration.hpp"
#include "support/scan.hpp"

namespace gpureg {
namespace {

struct Block {
  Eigen::Vector3d low, high;
};

/// The ground, 0.2 m thick, and two rows of buildings: closed, as the models of cities are.
std::vector<Block> model_of_street(std::mt19937& random) {
  const auto between = [&](double a, double b) {
    return std::uniform_real_distribution<double>(a, b)(random);
  };
  std::vector<Block> out{{{-60, -35, -0.2}, {60, 35, 0}}};
  for (const int side : {-1, 1})
    for (double x = -55; x < 55;) {
      const double width = between(8, 18), height = between(5, 16), depth = between(8, 14),
                   front = 11 + between(0, 3);
      const double a = side * front, b = side * (front + depth);
      out.push_back({{x, std::min(a, b), 0}, {x + width, std::max(a, b), height}});
      x += width + between(0, 5);
    }
  return out;
}

/// Parked cars, which the model does not have.
void add_cars(std::mt19937& random, std::vector<Block>& street) {
  std::uniform_real_distribution<double> along(-50, 50), beside(4.2, 5.2);
  for (int k = 0; k < 14; ++k) {
    const double x = along(random), y = (k % 2 == 0 ? 1 : -1) * beside(random);
    street.push_back({{x - 2.1, y - 0.9, 0.15}, {x + 2.1, y + 0.9, 1.05}});
    street.push_back({{x - 1.3, y - 0.8, 1}, {x + 0.9, y + 0.8, 1.5}});
  }
}

/// Four points per square metre at random, with outward normals.
PointCloud sampled(const std::vector<Block>& blocks, std::mt19937& random) {
  std::uniform_real_distribution<double> unit;
  PointCloud out;
  for (const Block& block : blocks) {
    const Eigen::Vector3d size = block.high - block.low;
    for (int axis = 0; axis < 3; ++axis) {
      const int u = (axis + 1) % 3, v = (axis + 2) % 3;
      for (const int side : {0, 1})
        for (int k = static_cast<int>(4 * size[u] * size[v]); k > 0; --k) {
          Eigen::Vector3d p = block.low;
          p[axis] += side * size[axis];
          p[u] += unit(random) * size[u];
          p[v] += unit(random) * size[v];
          out.points.push_back(p.cast<float>());
          out.normals.push_back((2 * side - 1) * Eigen::Vector3f::Unit(axis));
        }
    }
  }
  return out;
}

double range_of(const Block& block, const Eigen::Vector3d& from, const Eigen::Vector3d& ray) {
  double near = 0, far = std::numeric_limits<double>::infinity();
  for (int k = 0; k < 3; ++k) {
    const double a = (block.low[k] - from[k]) / ray[k], b = (block.high[k] - from[k]) / ray[k];
    near = std::max(near, std::min(a, b));
    far = std::min(far, std::max(a, b));
  }
  return near < far ? near : std::numeric_limits<double>::infinity();
}

/// What 16 rings of a spinning sensor see up to 80 m away, in the sensor's frame; noise of 2 cm.
std::vector<Eigen::Vector3f> sweep(const std::vector<Block>& street,
                                   const Eigen::Isometry3d& street_from_sensor,
                                   std::mt19937& random) {
  std::normal_distribution<double> noise(0, 0.02);
  std::vector<Eigen::Vector3f> out;
  for (int ring = 0; ring < 16; ++ring)
    for (int step = 0; step < 1800; ++step) {
      const double up = (2 * ring - 15) * M_PI / 180, turn = step * M_PI / 900;
      const Eigen::Vector3d ray(std::cos(up) * std::cos(turn), std::cos(up) * std::sin(turn),
                                std::sin(up));
      double range = 80;
      for (const Block& block : street)
        range = std::min(range, range_of(block, street_from_sensor.translation(),
                                         street_from_sensor.linear() * ray));
      if (range < 80) out.push_back(((range + noise(random)) * ray).cast<float>());
    }
  return out;
}

// Streets whose most likely poses are about a metre too low: as many points are near the model as
// at the right height.
TEST(ScanOnModel, TheGroundLiesOnItsOwnSide) {
  const Eigen::Isometry3d truth =
      Eigen::Translation3d(-12, 1.5, 1.9) * Eigen::AngleAxisd(2.3, Eigen::Vector3d::UnitZ());
  for (const unsigned seed : {5u, 11u}) {
    std::mt19937 random(seed);
    std::vector<Block> street = model_of_street(random);
    const PointCloud model = sampled(street, random);
    add_cars(random, street);
    const std::vector<Eigen::Vector3f> points = sweep(street, truth, random);
    const float sensor[3] = {0, 0, 0};
    PointCloudView scan(points), target = model.view();
    scan.viewpoints = sensor;
    scan.viewpoint_count = 1;
    target.model = true;
    RegistrationPrior prior;
    prior.gravity = GravityPrior{};
    const RegistrationResult r =
        align(Context::cpu(), scan, target, RegistrationOptions{0.85f}, prior);
    EXPECT_TRUE(r.aligned()) << r.confidence;
    // A tenth of a voxel: found are 1 to 3 cm.
    EXPECT_LT(test::translation_error(truth, Eigen::Isometry3d(r.target_from_source.matrix())),
              0.085)
        << "seed " << seed;
  }
}

}  // namespace
}  // namespace gpureg
