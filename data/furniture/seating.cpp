// SPDX-License-Identifier: BSD-3-Clause
#include <cmath>

#include "data/furniture/furniture.hpp"

namespace gpureg::synthetic {

using Eigen::Vector3f;

Piece chair(Random& random) {
  const float w = random.uniform(0.40f, 0.48f), d = random.uniform(0.42f, 0.50f),
              back = random.uniform(0.82f, 1.0f);
  const int slats = random.between(2, 5);
  const bool padded = random.chance(0.5f);
  return {w, d, back, [=](MeshBuilder& mesh, Random& r) {
            mesh.paint(wood(r));
            for (const float x : {-w / 2 + 0.02f, w / 2 - 0.02f}) {
              mesh.tube({{x, d - 0.03f, 0}, {x * 0.95f, d - 0.05f, 0.44f}}, 0.018f);
              mesh.tube({{x, 0.0f, 0}, {x, 0.05f, 0.44f}, {x, 0.02f, 0.7f}, {x, -0.03f, back}},
                        0.018f);
              mesh.tube({{x, 0.03f, 0.2f}, {x, d - 0.04f, 0.2f}}, 0.01f);
            }
            mesh.box({-w / 2, 0.02f, 0.42f}, {w / 2, d, 0.45f});
            for (int i = 0; i < slats; ++i) {
              const float z =
                  0.52f + (back - 0.58f) * static_cast<float>(i + 1) / static_cast<float>(slats);
              mesh.sheet(
                  [&](float u, float v) -> Vector3f {
                    const float x = (u - 0.5f) * (w - 0.04f);
                    return {x, -0.02f - 0.03f * std::cos(3.0f * x / w), z - 0.05f * v};
                  },
                  6, 1);
            }
            if (padded) {
              mesh.paint(fabric(r));
              mesh.cushion({-w / 2 + 0.02f, 0.05f, 0.44f}, {w / 2 - 0.02f, d - 0.02f, 0.50f});
            }
          }};
}

Piece office_chair(Random& random) {
  const float seat = random.uniform(0.45f, 0.52f);
  return {0.6f, 0.6f, 1.05f, [=](MeshBuilder& mesh, Random& r) {
            mesh.paint(metal(r));
            const Vector3f hub(0, 0.3f, 0.1f);
            for (int i = 0; i < 5; ++i) {
              const float a = 1.2566f * static_cast<float>(i) + 0.3f;
              const Vector3f end = hub + Vector3f(0.28f * std::cos(a), 0.28f * std::sin(a), -0.05f);
              mesh.tube({hub, end}, 0.02f);
              mesh.ellipsoid(end - Vector3f(0, 0, 0.02f), {0.03f, 0.03f, 0.03f});
            }
            mesh.cylinder({0, 0.3f, 0.1f}, 0.03f, seat - 0.12f);
            mesh.paint(fabric(r));
            mesh.cushion({-0.25f, 0.06f, seat - 0.04f}, {0.25f, 0.56f, seat + 0.05f});
            mesh.sheet(
                [&](float u, float v) -> Vector3f {
                  const float x = 0.46f * (u - 0.5f) * (1 - 0.3f * v * v);
                  return {x, 0.02f + 1.1f * x * x - 0.05f * std::sin(5 * v),
                          seat + 0.1f + 0.5f * v};
                },
                10, 10);
            for (const float x : {-0.29f, 0.29f}) {
              mesh.tube({{x * 0.8f, 0.3f, seat},
                         {x, 0.3f, seat},
                         {x, 0.25f, seat + 0.2f},
                         {x, 0.45f, seat + 0.2f}},
                        0.018f);
            }
          }};
}

namespace {

Piece upholstered(Random& random, int seats) {
  const float seat = random.uniform(0.58f, 0.72f), arm = random.uniform(0.12f, 0.22f),
              d = random.uniform(0.80f, 0.95f);
  const float w = static_cast<float>(seats) * seat + 2 * arm, back = random.uniform(0.72f, 0.92f);
  const int pillows = random.between(0, seats);
  return {w, d, back, [=](MeshBuilder& mesh, Random& r) {
            const Material cover = fabric(r);
            mesh.paint(cover);
            mesh.box({-w / 2 + 0.03f, 0.05f, 0.08f}, {w / 2 - 0.03f, d - 0.03f, 0.28f});
            for (const float side : {-1.0f, 1.0f}) {
              const float x = side * (w - arm) / 2;
              mesh.cushion({x - arm / 2, 0.02f, 0.05f}, {x + arm / 2, d, 0.62f}, 0.25f);
            }
            for (int i = 0; i < seats; ++i) {
              const float x = -w / 2 + arm + seat * static_cast<float>(i);
              mesh.cushion({x, 0.18f, 0.26f}, {x + seat, d - 0.02f, 0.46f}, 0.3f);
              mesh.cushion({x + 0.01f, 0.02f, 0.34f}, {x + seat - 0.01f, 0.24f, back}, 0.35f);
            }
            for (int i = 0; i < pillows; ++i) {
              mesh.paint(fabric(r));
              const Eigen::Affine3f frame = mesh.frame();
              mesh.place(frame *
                         Eigen::Translation3f(r.uniform(-w / 2 + arm + 0.2f, w / 2 - arm - 0.2f),
                                              0.36f, 0.64f) *
                         Eigen::AngleAxisf(r.uniform(0.9f, 1.3f), Vector3f::UnitX()) *
                         Eigen::AngleAxisf(r.uniform(-0.5f, 0.5f), Vector3f::UnitZ()));
              mesh.cushion({-0.21f, -0.21f, -0.07f}, {0.21f, 0.21f, 0.07f}, 0.8f);
              mesh.place(frame);
            }
            mesh.paint(wood(r));
            for (const float x : {-w / 2 + 0.08f, w / 2 - 0.08f}) {
              for (const float y : {0.08f, d - 0.08f}) mesh.cylinder({x, y, 0}, 0.025f, 0.08f, 8);
            }
          }};
}

}  // namespace

Piece sofa(Random& random) { return upholstered(random, random.between(2, 3)); }
Piece armchair(Random& random) { return upholstered(random, 1); }

Piece bed(Random& random) {
  const float w = random.chance(0.5f) ? random.uniform(0.95f, 1.1f) : random.uniform(1.5f, 1.8f);
  const float d = random.uniform(2.0f, 2.15f), head = random.uniform(0.7f, 1.1f);
  const std::uint64_t crumple = random.bits();
  return {w, d, head, [=](MeshBuilder& mesh, Random& r) {
            mesh.paint(wood(r));
            mesh.box({-w / 2, 0, 0}, {w / 2, 0.05f, head});
            mesh.box({-w / 2, 0.05f, 0.12f}, {w / 2, d, 0.30f});
            mesh.box({-w / 2, d - 0.04f, 0.0f}, {w / 2, d, 0.42f});
            mesh.paint(fabric(r));
            mesh.cushion({-w / 2 + 0.02f, 0.05f, 0.28f}, {w / 2 - 0.02f, d - 0.05f, 0.52f}, 0.15f);
            mesh.paint(fabric(r));
            const int pillows = w > 1.4f ? 2 : 1;
            for (int i = 0; i < pillows; ++i) {
              const float x = pillows == 1 ? 0.0f : (i ? 0.25f : -0.25f) * w;
              mesh.cushion({x - 0.33f, 0.1f, 0.50f}, {x + 0.33f, 0.52f, 0.66f}, 0.7f);
            }
            // The blanket: a crumpled sheet whose sides hang down.
            mesh.paint(fabric(r));
            Random wave(crumple);
            const float a = wave.uniform(3, 7), b = wave.uniform(3, 7), c = wave.uniform(0, 6),
                        edge = wave.uniform(0.6f, 1.0f);
            mesh.sheet(
                [&](float u, float v) -> Vector3f {
                  const float across = (2 * u - 1) * (w / 2 + 0.22f),
                              hang = std::max(0.0f, std::abs(across) - w / 2);
                  const float y = edge + (d - edge) * v;
                  const float folds = 0.03f * std::sin(a * across + b * y + c) +
                                      0.02f * std::sin(2.3f * b * across - a * y);
                  const float x =
                      std::copysign(std::min(std::abs(across), w / 2) + 0.1f * hang, across);
                  return {x + 0.3f * folds, y, 0.57f + folds - 0.95f * hang};
                },
                36, 30);
          }};
}

}  // namespace gpureg::synthetic
