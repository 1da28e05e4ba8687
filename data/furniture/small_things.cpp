// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <cmath>

#include "data/furniture/furniture.hpp"

namespace gpureg::synthetic {
namespace {

using Eigen::Vector2f;
using Eigen::Vector3f;

constexpr float kTurn = 6.2831853f;

std::vector<Vector3f> circle(const Vector3f& centre, float radius, int steps) {
  std::vector<Vector3f> line;  // in the plane y = const
  for (int i = 0; i <= steps; ++i) {
    const float a = kTurn * static_cast<float>(i) / static_cast<float>(steps);
    line.push_back(centre + radius * Vector3f(std::cos(a), 0, std::sin(a)));
  }
  return line;
}

}  // namespace

void book_row(MeshBuilder& mesh, Random& random, float left, float right, float back, float depth,
              float bottom, float max_height) {
  float x = left;
  while (true) {
    const float width = random.uniform(0.012f, 0.05f),
                height = std::min(max_height, random.uniform(0.2f, 0.28f));
    if (x + width > right) return;
    mesh.paint(paint(random));
    mesh.box({x, back, bottom},
             {x + width - 0.002f, back + depth * random.uniform(0.85f, 0.95f), bottom + height});
    x += width;
    if (random.chance(0.06f)) x += random.uniform(0.02f, 0.12f);
  }
}

void small_thing(MeshBuilder& mesh, Random& random, const Vector3f& at, float radius) {
  const Eigen::Affine3f frame = mesh.frame();
  mesh.place(frame * upright(at, random.uniform(0, kTurn)));
  const float s = radius * random.uniform(0.6f, 1.0f);
  mesh.paint(paint(random));
  switch (random.below(9)) {
    case 0: {  // a pile of books
      float z = 0;
      for (int i = random.between(1, 5); i > 0; --i) {
        const float t = random.uniform(0.015f, 0.04f), a = s * random.uniform(0.5f, 0.7f),
                    b = s * random.uniform(0.7f, 0.8f);
        mesh.paint(paint(random));
        mesh.box({-a, -b, z}, {a, b, z + t});
        z += t;
      }
      break;
    }
    case 1: {  // a vase
      const float h = random.uniform(1.5f, 3.0f) * s, belly = random.uniform(0.5f, 0.9f) * s;
      mesh.lathe({0, 0, 0},
                 {{0, 0},
                  {0.4f * s, 0},
                  {belly, 0.35f * h},
                  {0.6f * belly, 0.7f * h},
                  {0.25f * s, 0.85f * h},
                  {0.4f * s, h}},
                 18);
      break;
    }
    case 2:
      mesh.box({-0.6f * s, -0.45f * s, 0}, {0.6f * s, 0.45f * s, random.uniform(0.4f, 1.4f) * s});
      break;
    case 3:
      mesh.ellipsoid({0, 0, 0.7f * s}, {0.7f * s, 0.7f * s, 0.7f * s});
      break;
    case 4:  // a bowl with fruit
      mesh.lathe({0, 0, 0}, {{0.3f * s, 0}, {0.7f * s, 0.2f * s}, {s, 0.6f * s}}, 18);
      for (int i = 0; i < 4; ++i) {
        const float a = 1.6f * static_cast<float>(i);
        mesh.paint(paint(random));
        mesh.ellipsoid({0.4f * s * std::cos(a), 0.4f * s * std::sin(a), 0.5f * s},
                       Vector3f::Constant(0.3f * s));
      }
      break;
    case 5: {  // mugs and bottles
      for (int i = random.between(1, 3); i > 0; --i) {
        const Vector3f p(random.uniform(-0.5f, 0.5f) * s, random.uniform(-0.5f, 0.5f) * s, 0);
        if (random.chance(0.5f)) {
          mesh.cylinder(p, 0.04f, 0.1f, 12);
        } else {
          mesh.lathe(
              p, {{0, 0}, {0.04f, 0}, {0.04f, 0.16f}, {0.014f, 0.22f}, {0.014f, 0.28f}, {0, 0.28f}},
              12);
        }
      }
      break;
    }
    case 6:  // a table lamp
      mesh.lathe({0, 0, 0}, {{0, 0}, {0.5f * s, 0}, {0.12f * s, 0.2f * s}, {0.1f * s, 1.3f * s}},
                 14);
      mesh.paint(fabric(random));
      mesh.lathe({0, 0, 1.2f * s}, {{0.9f * s, 0}, {0.5f * s, 0.9f * s}}, 18);
      break;
    case 7:  // a teddy: ellipsoids
      mesh.ellipsoid({0, 0, 0.5f * s}, {0.45f * s, 0.4f * s, 0.5f * s});
      mesh.ellipsoid({0, 0, 1.2f * s}, Vector3f::Constant(0.35f * s));
      for (const float side : {-1.0f, 1.0f}) {
        mesh.ellipsoid({side * 0.5f * s, 0.2f * s, 0.6f * s}, {0.25f * s, 0.2f * s, 0.2f * s});
        mesh.ellipsoid({side * 0.3f * s, 0.45f * s, 0.18f * s}, {0.18f * s, 0.4f * s, 0.18f * s});
        mesh.ellipsoid({side * 0.28f * s, 0, 1.5f * s}, Vector3f::Constant(0.14f * s));
      }
      break;
    default:  // a bag
      mesh.cushion({-0.6f * s, -0.35f * s, 0}, {0.6f * s, 0.35f * s, 1.2f * s}, 0.5f);
      mesh.tube({{-0.3f * s, 0, 1.1f * s},
                 {-0.2f * s, 0, 1.6f * s},
                 {0.2f * s, 0, 1.6f * s},
                 {0.3f * s, 0, 1.1f * s}},
                0.012f);
  }
  mesh.place(frame);
}

void litter(MeshBuilder& mesh, Random& random, const Vector3f& low, const Vector3f& high,
            int count) {
  const float room = 0.5f * std::min(high.x() - low.x(), high.y() - low.y());
  const float radius = std::clamp(room, 0.02f, 0.16f);
  for (int i = random.between(0, count); i > 0; --i) {
    const float margin = std::min(radius, 0.9f * room);
    small_thing(mesh, random,
                {random.uniform(low.x() + margin, high.x() - margin),
                 random.uniform(low.y() + margin, high.y() - margin), low.z()},
                random.uniform(0.5f, 1.0f) * radius);
  }
}

Piece floor_lamp(Random& random) {
  const float h = random.uniform(1.4f, 1.8f), shade = random.uniform(0.16f, 0.24f);
  return {0.45f, 0.45f, h, [=](MeshBuilder& mesh, Random& r) {
            mesh.paint(metal(r));
            mesh.lathe({0, 0.22f, 0},
                       {{0, 0}, {0.15f, 0}, {0.14f, 0.03f}, {0.015f, 0.05f}, {0.015f, h - 0.2f}},
                       16);
            mesh.paint(fabric(r));
            mesh.lathe({0, 0.22f, h - 0.3f}, {{shade, 0}, {0.6f * shade, 0.3f}}, 22);
          }};
}

Piece plant(Random& random) {
  const float pot = random.uniform(0.13f, 0.22f), h = random.uniform(0.7f, 1.6f);
  const int leaves = random.between(10, 26);
  return {0.6f, 0.6f, h, [=](MeshBuilder& mesh, Random& r) {
            mesh.paint(paint(r));
            mesh.lathe({0, 0.3f, 0},
                       {{0, 0},
                        {0.7f * pot, 0},
                        {pot, 1.6f * pot},
                        {1.08f * pot, 1.7f * pot},
                        {0.9f * pot, 1.7f * pot},
                        {0, 1.5f * pot}},
                       20);
            Material green;
            green.pattern = Pattern::leaf;
            green.base = {0.08f, 0.25f, 0.06f};
            green.second = {0.25f, 0.5f, 0.15f};
            mesh.paint(green);
            for (int i = 0; i < leaves; ++i) {
              const float a = r.uniform(0, kTurn), z = r.uniform(1.7f * pot, h - 0.1f),
                          length = r.uniform(0.2f, 0.45f), width = r.uniform(0.04f, 0.12f);
              const Vector3f out(std::cos(a), std::sin(a), 0), side(-out.y(), out.x(), 0),
                  root(0, 0.3f, z);
              const float rise = r.uniform(0.0f, 0.25f), sag = r.uniform(0.1f, 0.35f);
              mesh.sheet(
                  [&](float u, float v) -> Vector3f {
                    const float half = width * std::sin(3.1f * v + 0.03f) * (2 * u - 1);
                    return root + length * v * out + half * side +
                           Vector3f(0, 0, rise * v - sag * v * v + 0.6f * std::abs(half));
                  },
                  4, 8);
            }
            mesh.tube({{0, 0.3f, pot}, {0.03f, 0.32f, 0.5f * h}, {0, 0.3f, h - 0.1f}}, 0.015f);
          }};
}

Piece bicycle(Random& random) {
  const float tilt = random.uniform(0.05f, 0.12f);
  return {1.7f, 0.5f, 1.05f, [=](MeshBuilder& mesh, Random& r) {
            const Eigen::Affine3f frame = mesh.frame();
            mesh.place(frame * Eigen::Translation3f(0, 0.2f, 0) *
                       Eigen::AngleAxisf(tilt, Vector3f::UnitX()));
            mesh.paint(metal(r));
            for (const float x : {-0.52f, 0.52f}) {
              const Vector3f hub(x, 0, 0.34f);
              mesh.tube(circle(hub, 0.32f, 28), 0.02f);
              mesh.tube({hub - Vector3f(0, 0.04f, 0), hub + Vector3f(0, 0.04f, 0)}, 0.02f);
              for (int i = 0; i < 12; ++i) {
                const float a = kTurn * static_cast<float>(i) / 12.0f;
                mesh.tube({hub, hub + 0.31f * Vector3f(std::cos(a), 0, std::sin(a))}, 0.003f, 4);
              }
            }
            mesh.paint(paint(r));
            const Vector3f pedal(-0.08f, 0, 0.3f), saddle(-0.2f, 0, 0.85f), head(0.36f, 0, 0.85f),
                rear(-0.52f, 0, 0.34f), front(0.52f, 0, 0.34f);
            for (const auto& line : {std::vector<Vector3f>{pedal, saddle, head, pedal},
                                     {saddle, rear, pedal},
                                     {front, head, head + Vector3f(-0.04f, 0, 0.15f)}}) {
              mesh.tube(line, 0.017f);
            }
            mesh.tube({{0.22f, -0.28f, 1.0f},
                       {0.32f, -0.15f, 1.02f},
                       {0.32f, 0.15f, 1.02f},
                       {0.22f, 0.28f, 1.0f}},
                      0.014f);
            mesh.cushion({-0.33f, -0.07f, 0.85f}, {-0.08f, 0.07f, 0.92f}, 0.6f);
            mesh.tube(circle(pedal, 0.09f, 16), 0.008f);
            mesh.place(frame);
          }};
}

Piece drying_rack(Random& random) {
  const int towels = random.between(1, 3);
  return {1.1f, 0.6f, 1.0f, [=](MeshBuilder& mesh, Random& r) {
            mesh.paint(metal(r));
            for (const float y : {0.05f, 0.55f}) {
              mesh.tube({{-0.5f, y, 0.95f}, {0.5f, y, 0.95f}}, 0.01f);
              mesh.tube({{-0.45f, y, 0.95f}, {-0.45f, 0.6f - y, 0}}, 0.01f);
              mesh.tube({{0.45f, y, 0.95f}, {0.45f, 0.6f - y, 0}}, 0.01f);
            }
            for (int i = 0; i < 14; ++i) {
              const float x = -0.48f + 0.074f * static_cast<float>(i);
              mesh.tube({{x, 0.05f, 0.95f}, {x, 0.55f, 0.95f}}, 0.005f, 5);
            }
            for (int i = 0; i < towels; ++i) {
              mesh.paint(fabric(r));
              const float left = r.uniform(-0.5f, 0.1f), phase = r.uniform(0, 6);
              mesh.sheet(
                  [&](float u, float v) -> Vector3f {
                    const float y = 0.05f + 0.03f * std::sin(9 * u + phase) * v;
                    return {left + 0.35f * u, y, 0.96f - 0.6f * v};
                  },
                  12, 6);
            }
          }};
}

Piece clutter_heap(Random& random) {
  const float w = random.uniform(0.4f, 0.8f), d = random.uniform(0.3f, 0.5f);
  const int boxes = random.between(1, 4);
  return {w, d, 0.8f, [=](MeshBuilder& mesh, Random& r) {
            float z = 0;
            for (int i = 0; i < boxes && z < 0.8f; ++i) {
              const Eigen::Affine3f frame = mesh.frame();
              mesh.place(frame * upright({0, d / 2, z}, r.uniform(-0.3f, 0.3f)));
              const float a = 0.45f * w * r.uniform(0.6f, 1.0f),
                          b = 0.45f * d * r.uniform(0.6f, 1.0f), h = r.uniform(0.12f, 0.35f);
              Material card = wood(r);
              card.pattern = Pattern::plain;
              mesh.paint(card);
              mesh.box({-a, -b, 0}, {a, b, h});
              z += h;
              mesh.place(frame);
            }
            litter(mesh, r, {-0.3f * w, 0.3f * d, z}, {0.3f * w, 0.7f * d, z}, 2);
            small_thing(mesh, r, {0.5f * w, 0.8f * d, 0}, 0.15f);
          }};
}

}  // namespace gpureg::synthetic
