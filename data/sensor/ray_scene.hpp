// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>
#include <memory>

#include "data/mesh.hpp"

namespace gpureg::synthetic {

struct RayHit {
  bool hit = false;
  float t = 0;                      ///< in lengths of the ray's direction
  Eigen::Vector3f normal{0, 0, 1};  ///< unit, towards the ray's origin
  std::uint32_t triangle = 0;
};

/// A mesh to cast rays at. cast() may be called from any number of threads.
class RayScene {
 public:
  /// Keeps a reference to the mesh. Throws Error when the ray tracer cannot start.
  explicit RayScene(const Mesh& mesh);
  ~RayScene();
  RayScene(const RayScene&) = delete;
  RayScene& operator=(const RayScene&) = delete;

  RayHit cast(const Eigen::Vector3f& origin, const Eigen::Vector3f& direction) const;
  const Mesh& mesh() const { return mesh_; }

 private:
  struct Embree;
  const Mesh& mesh_;
  std::unique_ptr<Embree> embree_;
};

}  // namespace gpureg::synthetic
