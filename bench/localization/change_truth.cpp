// SPDX-License-Identifier: BSD-3-Clause
#include "change_truth.hpp"

#include <cmath>

#include "data/random.hpp"

namespace gpureg::bench {
namespace {

constexpr float kHere = 0.03f, kNear = 0.075f, kBehind = 0.1f;
// The camera of data/sensor/camera.hpp and its depths.
constexpr double kTangentX = 320.0 / 525, kTangentY = 240.0 / 525, kLeast = 0.4, kMost = 4;

/// Random points of the triangles, some 5,000 per square metre.
std::vector<Eigen::Vector3f> samples(const synthetic::Mesh& mesh) {
  constexpr float kPerArea = 5000;
  synthetic::Random random(1);
  std::vector<Eigen::Vector3f> out;
  for (const auto& triangle : mesh.triangles) {
    const Eigen::Vector3f a = mesh.vertices[triangle[0]], b = mesh.vertices[triangle[1]] - a,
                          c = mesh.vertices[triangle[2]] - a;
    const float wanted = 0.5f * b.cross(c).norm() * kPerArea + random.uniform();
    for (int k = static_cast<int>(wanted); k > 0; --k) {
      float u = random.uniform(), v = random.uniform();
      if (u + v > 1) u = 1 - u, v = 1 - v;
      out.push_back(a + u * b + v * c);
    }
  }
  return out;
}

}  // namespace

TrueHouse::TrueHouse(synthetic::House house) : house_(std::move(house)), scene_(house_.mesh) {
  const std::vector<Eigen::Vector3f> points = samples(house_.mesh);
  here_ = std::make_unique<synthetic::NeighbourGrid>(points, kHere);
  near_ = std::make_unique<synthetic::NeighbourGrid>(points, kNear);
}

TrueHouse::Surface TrueHouse::surface_at(const Eigen::Vector3f& p) const {
  if (here_->any_within_radius(p)) return Surface::here;
  return near_->any_within_radius(p) ? Surface::near : Surface::none;
}

bool TrueHouse::seen_through(const Eigen::Vector3f& p, const Cameras& cameras,
                             const synthetic::NeighbourGrid& recorded) const {
  for (const Eigen::Isometry3d& camera : cameras) {
    const Eigen::Vector3d in_camera = camera.inverse() * p.cast<double>();
    if (!(in_camera.z() > kLeast && in_camera.z() < kMost)) continue;
    if (std::abs(in_camera.x()) > kTangentX * in_camera.z() ||
        std::abs(in_camera.y()) > kTangentY * in_camera.z())
      continue;
    const Eigen::Vector3f from = camera.translation().cast<float>(), along = p - from;
    const synthetic::RayHit hit = scene_.cast(from, along);
    if (!hit.hit || static_cast<double>(hit.t) * in_camera.z() > kMost) continue;
    if ((hit.t - 1) * along.norm() > kBehind && recorded.any_within_radius(from + hit.t * along))
      return true;
  }
  return false;
}

}  // namespace gpureg::bench
