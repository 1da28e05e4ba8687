// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <cmath>

#include "data/furniture/furniture.hpp"
#include "data/rooms/house.hpp"

namespace gpureg::synthetic {
namespace {

using Eigen::Vector3f;

/// The inner face of a wall without its holes, in the wall's frame.
void face(MeshBuilder& mesh, float length, float height, const std::vector<Opening>& holes) {
  std::vector<float> xs{0, length}, zs{0, height};
  for (const Opening& hole : holes) {
    xs.insert(xs.end(), {hole.from, hole.to});
    zs.insert(zs.end(), {hole.bottom, hole.top});
  }
  std::sort(xs.begin(), xs.end());
  std::sort(zs.begin(), zs.end());
  for (std::size_t i = 0; i + 1 < xs.size(); ++i) {
    for (std::size_t k = 0; k + 1 < zs.size(); ++k) {
      const float x = 0.5f * (xs[i] + xs[i + 1]), z = 0.5f * (zs[k] + zs[k + 1]);
      const bool open = std::any_of(holes.begin(), holes.end(), [&](const Opening& hole) {
        return x > hole.from && x < hole.to && z > hole.bottom && z < hole.top;
      });
      if (open || xs[i + 1] - xs[i] < 1e-4f || zs[k + 1] - zs[k] < 1e-4f) continue;
      mesh.quad({xs[i], 0, zs[k]}, {xs[i + 1], 0, zs[k]}, {xs[i + 1], 0, zs[k + 1]},
                {xs[i], 0, zs[k + 1]});
    }
  }
}

/// The inner sides of a hole (and the back of a niche).
void reveal(MeshBuilder& mesh, const Opening& h) {
  const float d = -h.depth;
  mesh.quad({h.from, 0, h.bottom}, {h.from, d, h.bottom}, {h.from, d, h.top}, {h.from, 0, h.top});
  mesh.quad({h.to, 0, h.bottom}, {h.to, d, h.bottom}, {h.to, d, h.top}, {h.to, 0, h.top});
  mesh.quad({h.from, 0, h.top}, {h.to, 0, h.top}, {h.to, d, h.top}, {h.from, d, h.top});
  // A doorway's floor belongs to the room; two coincident surfaces would flicker.
  const float sill = h.bottom + (h.bottom > 0 ? 0.0f : 0.004f);
  if (h.kind != Opening::Kind::door)
    mesh.quad({h.from, 0, sill}, {h.to, 0, sill}, {h.to, d, sill}, {h.from, d, sill});
  if (h.kind == Opening::Kind::niche) {
    mesh.quad({h.from, d, h.bottom}, {h.to, d, h.bottom}, {h.to, d, h.top}, {h.from, d, h.top});
  }
}

/// Frame and bars; the glass itself returns nothing to the sensor.
void window_frame(MeshBuilder& mesh, Random& random, const Opening& h) {
  const float back = -h.depth, front = back + 0.06f, bar = 0.05f, middle = 0.5f * (h.from + h.to);
  mesh.box({h.from, back, h.bottom}, {h.to, front, h.bottom + bar});
  mesh.box({h.from, back, h.top - bar}, {h.to, front, h.top});
  for (const float x : {h.from, h.to - bar, middle - bar / 2})
    mesh.box({x, back, h.bottom}, {x + bar, front, h.top});
  if (random.chance(0.5f)) {
    const float z = h.bottom + 0.65f * (h.top - h.bottom);
    mesh.box({h.from, back, z}, {h.to, front, z + 0.03f});
  }
  mesh.box({h.from - 0.05f, 0.001f, h.bottom - 0.03f}, {h.to + 0.05f, 0.06f, h.bottom});
}

void door_frame(MeshBuilder& mesh, Random& random, const Opening& h, const Room& room) {
  const float rim = 0.07f, out = 0.018f;
  mesh.box({h.from - rim, 0, 0}, {h.from, out, h.top + rim});
  mesh.box({h.to, 0, 0}, {h.to + rim, out, h.top + rim});
  mesh.box({h.from, 0, h.top}, {h.to, out, h.top + rim});
  if (h.to - h.from > 1.2f || !random.chance(0.4f))
    return;  // an archway, or a leaf that opens the other way
  const Eigen::Affine3f frame = mesh.frame();
  const bool left = random.chance(0.5f);
  const float angle = random.uniform(1.75f, 2.6f), width = h.to - h.from - 0.02f;
  const Eigen::Affine3f world_from_leaf =
      frame * upright({left ? h.from : h.to, 0.02f, 0}, left ? angle : 3.14159265f - angle);
  const Eigen::Vector2f end = (world_from_leaf * Vector3f(width, 0, 0)).head<2>();
  if ((end.array() < room.floor.low.array() + 0.05f).any() ||
      (end.array() > room.floor.high.array() - 0.05f).any())
    return;
  mesh.place(world_from_leaf);
  mesh.box({0, -0.02f, 0.01f}, {width, 0.02f, h.top - 0.01f});
  for (const float z : {0.25f, 1.1f})
    mesh.box({0.12f, -0.03f, z}, {width - 0.12f, 0.03f, z + 0.7f});
  mesh.tube({{width - 0.06f, -0.06f, 1.02f},
             {width - 0.06f, 0.06f, 1.02f},
             {width - 0.17f, 0.06f, 1.02f}},
            0.01f);
  mesh.tube({{width - 0.06f, -0.06f, 1.02f}, {width - 0.17f, -0.06f, 1.02f}}, 0.01f);
  mesh.place(frame);
}

void baseboard(MeshBuilder& mesh, const Room& room, int side) {
  std::vector<Opening> gaps;
  for (const Opening& hole : room.openings[static_cast<std::size_t>(side)]) {
    if (hole.bottom < 0.1f) gaps.push_back(hole);
  }
  std::sort(gaps.begin(), gaps.end(),
            [](const Opening& a, const Opening& b) { return a.from < b.from; });
  float from = 0;
  for (const Opening& gap : gaps) {
    if (gap.from > from) mesh.box({from, 0, 0}, {gap.from, 0.015f, 0.08f});
    from = gap.to;
  }
  mesh.box({from, 0, 0}, {room.length(side), 0.015f, 0.08f});
}

Material wall_paint(Random& random) {
  Material m = paint(random);
  m.pattern = random.chance(0.12f)  ? Pattern::bricks
              : random.chance(0.2f) ? Pattern::stripes
                                    : Pattern::plaster;
  m.base = 0.3f * m.base + Vector3f::Constant(random.uniform(0.4f, 0.6f));
  m.second = random.uniform(0.75f, 0.95f) * m.base;
  m.scale = random.uniform(0.15f, 0.4f);
  return m;
}

Material flooring(Random& random) {
  Material m = random.chance(0.25f) ? fabric(random) : wood(random);
  if (m.pattern == Pattern::wood)
    m.pattern = random.chance(0.6f) ? Pattern::planks : Pattern::tiles;
  m.scale = m.pattern == Pattern::tiles ? 0.3f : 0.12f;
  return m;
}

}  // namespace

void build_walls(House& house, Random& random) {
  MeshBuilder mesh(house.mesh);
  const Material trim = random.chance(0.5f) ? paint(random) : wood(random);
  for (const Room& room : house.rooms) {
    const Rect& f = room.floor;
    mesh.place(Eigen::Affine3f::Identity());
    mesh.paint(flooring(random));
    // The floor reaches half-way under the walls, so that doorways have a floor too.
    const float under = 0.07f;
    mesh.quad({f.low.x() - under, f.low.y() - under, 0}, {f.high.x() + under, f.low.y() - under, 0},
              {f.high.x() + under, f.high.y() + under, 0},
              {f.low.x() - under, f.high.y() + under, 0});
    const Material wall = wall_paint(random);
    Material white = wall;
    white.pattern = Pattern::plaster;
    white.base = Vector3f::Constant(0.85f);
    white.second = Vector3f::Constant(0.75f);
    mesh.paint(white);
    mesh.quad({f.low.x(), f.low.y(), room.height}, {f.high.x(), f.low.y(), room.height},
              {f.high.x(), f.high.y(), room.height}, {f.low.x(), f.high.y(), room.height});
    mesh.paint(wall);
    for (int side = 0; side < 4; ++side) {
      mesh.place(room.world_from_side(side));
      face(mesh, room.length(side), room.height, room.openings[static_cast<std::size_t>(side)]);
      for (const Opening& hole : room.openings[static_cast<std::size_t>(side)]) reveal(mesh, hole);
    }
    mesh.paint(trim);
    for (int side = 0; side < 4; ++side) {
      mesh.place(room.world_from_side(side));
      baseboard(mesh, room, side);
      for (const Opening& hole : room.openings[static_cast<std::size_t>(side)]) {
        if (hole.kind == Opening::Kind::window) window_frame(mesh, random, hole);
        if (hole.kind == Opening::Kind::door) door_frame(mesh, random, hole, room);
      }
    }
  }
}

}  // namespace gpureg::synthetic
