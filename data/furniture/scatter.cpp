// SPDX-License-Identifier: BSD-3-Clause
#include "data/furniture/scatter.hpp"

#include <algorithm>
#include <cmath>
#include <vector>

#include "data/furniture/furniture.hpp"
#include "data/tours/walk_map.hpp"

namespace gpureg::synthetic {
namespace {

using Eigen::Vector2f;
using Eigen::Vector3f;

constexpr float kPassage = 0.5f;  // metres left between two pieces
constexpr float kAnyYaw = 6.2831853f;

using Maker = Piece (*)(Random&);
const Maker kMakers[] = {chair,     office_chair, armchair,     bookshelf,    wardrobe,
                         sideboard, desk,         floor_lamp,   coffee_table, plant,
                         bicycle,   drying_rack,  clutter_heap, clutter_heap};

class Scatterer {
 public:
  Scatterer(House& house, std::uint64_t seed)
      : mesh_(house.mesh),
        scene_(house.mesh),
        map_(scene_),
        places_(map_.free_places()),
        builder_(added_),
        random_(hash_key(seed, Purpose::furniture, 0x5CA77E12)) {}

  void run(float density) {
    const float area = WalkMap::kCell * WalkMap::kCell * static_cast<float>(places_.size());
    const int count = static_cast<int>(density * area);
    for (int i = 0; i < count; ++i) put_piece();
    for (int i = 0; i < count; ++i) put_small_thing();
    for (int i = 0; i < count; ++i) put_picture();
    // Only now: the ray tracer looks at the mesh as it was.
    const auto vertex = static_cast<std::uint32_t>(mesh_.vertices.size());
    const auto material = static_cast<std::uint16_t>(mesh_.palette.size());
    mesh_.vertices.insert(mesh_.vertices.end(), added_.vertices.begin(), added_.vertices.end());
    for (const auto& t : added_.triangles)
      mesh_.triangles.push_back({t[0] + vertex, t[1] + vertex, t[2] + vertex});
    for (const std::uint16_t m : added_.materials)
      mesh_.materials.push_back(static_cast<std::uint16_t>(m + material));
    mesh_.palette.insert(mesh_.palette.end(), added_.palette.begin(), added_.palette.end());
  }

 private:
  Vector2f any_place() {
    return places_[static_cast<std::size_t>(random_.below(static_cast<int>(places_.size())))];
  }

  void put_piece() {
    const Piece piece = kMakers[random_.below(static_cast<int>(std::size(kMakers)))](random_);
    const float radius = 0.5f * std::hypot(piece.width, piece.depth);
    for (int attempt = 0; attempt < 30; ++attempt) {
      const Vector2f at = any_place();
      const float yaw = random_.uniform(0, kAnyYaw);
      const bool crowded = std::any_of(taken_.begin(), taken_.end(), [&](const Circle& other) {
        return (other.centre - at).norm() < other.radius + radius + kPassage;
      });
      if (crowded) continue;
      const Eigen::Affine3f frame =
          upright({at.x(), at.y(), floor(at)}, yaw) * Eigen::Translation3f(0, -piece.depth / 2, 0);
      bool fits = true;
      for (const float x : {-piece.width / 2, piece.width / 2}) {
        for (const float y : {0.0f, piece.depth})
          fits = fits && map_.walkable((frame * Vector3f(x, y, 0)).head<2>());
      }
      if (!fits) continue;
      taken_.push_back({at, radius});
      builder_.place(frame);
      piece.build(builder_, random_);
      return;
    }
  }

  /// On a table, a shelf, a bed: surfaces between knee and breast height.
  void put_small_thing() {
    for (int attempt = 0; attempt < 60; ++attempt) {
      const Vector2f at = any_place() + Vector2f(random_.normal(), random_.normal());
      const RayHit down = scene_.cast({at.x(), at.y(), WalkMap::kHeadroom}, {0, 0, -1});
      const float height = WalkMap::kHeadroom - down.t;
      if (!down.hit || down.normal.z() < 0.95f || height < 0.35f || height > 1.2f) continue;
      builder_.place(Eigen::Affine3f::Identity());
      small_thing(builder_, random_, {at.x(), at.y(), height}, random_.uniform(0.06f, 0.15f));
      return;
    }
  }

  void put_picture() {
    for (int attempt = 0; attempt < 30; ++attempt) {
      const Vector2f at = any_place();
      const float yaw = random_.uniform(0, kAnyYaw), low = random_.uniform(1.0f, 1.6f),
                  width = random_.uniform(0.25f, 1.0f), height = random_.uniform(0.3f, 0.8f);
      const Vector3f eye(at.x(), at.y(), low + height / 2), ray(std::cos(yaw), std::sin(yaw), 0);
      const RayHit wall = scene_.cast(eye, ray);
      if (!wall.hit || wall.t > 6 || std::abs(wall.normal.z()) > 0.02f) continue;
      const Vector3f along = wall.normal.cross(Vector3f::UnitZ());
      Eigen::Affine3f frame = Eigen::Affine3f::Identity();
      frame.linear() << along, wall.normal, Vector3f::UnitZ();
      frame.translation() = eye + wall.t * ray;
      frame.translation().z() = 0;
      // Flat behind all of it?
      bool flat = true;
      for (const float x : {-width / 2, width / 2}) {
        for (const float z : {low, low + height}) {
          const RayHit back = scene_.cast(frame * Vector3f(x, 0.3f, z), -wall.normal);
          flat = flat && back.hit && std::abs(back.t - 0.3f) < 0.01f;
        }
      }
      if (!flat) continue;
      builder_.place(frame);
      picture(builder_, random_, 0, low, width, height);
      return;
    }
  }

  float floor(const Vector2f& at) const {
    const RayHit down = scene_.cast({at.x(), at.y(), WalkMap::kHeadroom}, {0, 0, -1});
    return WalkMap::kHeadroom - down.t;
  }

  struct Circle {
    Vector2f centre;
    float radius;
  };

  Mesh& mesh_;
  const RayScene scene_;
  const WalkMap map_;
  const std::vector<Vector2f> places_;
  Mesh added_;
  MeshBuilder builder_;
  Random random_;
  std::vector<Circle> taken_;
};

}  // namespace

void scatter(House& house, std::uint64_t seed, double density) {
  if (density > 0) Scatterer(house, seed).run(static_cast<float>(density));
}

}  // namespace gpureg::synthetic
