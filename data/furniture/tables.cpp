// SPDX-License-Identifier: BSD-3-Clause
#include <cmath>

#include "data/furniture/furniture.hpp"

namespace gpureg::synthetic {
namespace {

void four_legs(MeshBuilder& mesh, float w, float d, float top, float thickness, bool turned) {
  for (const float x : {-w / 2 + 0.06f, w / 2 - 0.06f}) {
    for (const float y : {0.06f, d - 0.06f}) {
      if (turned) {
        mesh.lathe({x, y, 0},
                   {{0.02f, 0},
                    {0.03f, 0.1f},
                    {0.018f, 0.2f},
                    {0.04f, 0.5f * top},
                    {0.025f, 0.8f * top},
                    {0.04f, top}},
                   10);
      } else {
        mesh.box({x - thickness / 2, y - thickness / 2, 0},
                 {x + thickness / 2, y + thickness / 2, top});
      }
    }
  }
}

Piece table(Random& random, float w, float d, float height, int things) {
  const bool turned = random.chance(0.4f), cloth = random.chance(0.3f);
  return {w, d, height, [=](MeshBuilder& mesh, Random& r) {
            mesh.paint(wood(r));
            four_legs(mesh, w, d, height - 0.03f, 0.06f, turned);
            mesh.box({-w / 2, 0, height - 0.035f}, {w / 2, d, height});
            mesh.box({-w / 2 + 0.06f, 0.06f, height - 0.12f},
                     {w / 2 - 0.06f, d - 0.06f, height - 0.035f});
            if (cloth) {
              mesh.paint(fabric(r));
              mesh.box({-w / 4, -0.01f, height - 0.15f}, {w / 4, d + 0.01f, height + 0.005f});
            }
            litter(mesh, r, {-w / 2, 0, height}, {w / 2, d, height}, things);
          }};
}

}  // namespace

Piece dining_table(Random& random) {
  const float w = random.uniform(1.2f, 1.9f), d = random.uniform(0.75f, 0.95f),
              h = random.uniform(0.72f, 0.78f);
  return table(random, w, d, h, random.between(3, 9));
}

Piece coffee_table(Random& random) {
  const float w = random.uniform(0.7f, 1.1f), d = random.uniform(0.5f, 0.65f),
              h = random.uniform(0.35f, 0.48f);
  return table(random, w, d, h, random.between(2, 5));
}

Piece round_table(Random& random) {
  const float radius = random.uniform(0.4f, 0.6f), height = random.uniform(0.6f, 0.76f);
  const int things = random.between(2, 5);
  return {2 * radius, 2 * radius, height, [=](MeshBuilder& mesh, Random& r) {
            mesh.paint(wood(r));
            mesh.lathe({0, radius, 0},
                       {{0, 0},
                        {0.5f * radius, 0.01f},
                        {0.1f, 0.08f},
                        {0.04f, 0.2f},
                        {0.05f, height - 0.2f},
                        {0.2f, height - 0.03f},
                        {radius, height - 0.03f},
                        {radius, height},
                        {0, height}},
                       32);
            const float reach = 0.65f * radius;
            litter(mesh, r, {-reach, radius - reach, height}, {reach, radius + reach, height},
                   things);
          }};
}

Piece desk(Random& random) {
  const float w = random.uniform(1.2f, 1.6f), d = random.uniform(0.6f, 0.8f);
  const int screens = random.between(1, 2), things = random.between(3, 8);
  return {w, d, 1.2f, [=](MeshBuilder& mesh, Random& r) {
            mesh.paint(wood(r));
            four_legs(mesh, w, d, 0.7f, 0.05f, false);
            mesh.box({-w / 2, 0, 0.7f}, {w / 2, d, 0.735f});
            const float side = r.chance(0.5f) ? 1.0f : -1.0f;
            const float drawer = side * (w / 2 - 0.25f);
            for (int i = 0; i < 3; ++i) {
              const float z = 0.06f + 0.2f * static_cast<float>(i);
              mesh.box({drawer - 0.19f, 0.1f, z}, {drawer + 0.19f, d - 0.03f, z + 0.19f});
              mesh.tube({{drawer - 0.06f, d, z + 0.12f}, {drawer + 0.06f, d, z + 0.12f}}, 0.008f);
            }
            for (int i = 0; i < screens; ++i) {
              const Eigen::Affine3f frame = mesh.frame();
              const float x = screens == 1 ? -0.1f * side : (i ? 0.28f : -0.28f);
              mesh.place(frame * upright({x, 0.22f, 0.735f}, r.uniform(-0.3f, 0.3f)));
              Material black = metal(r);
              black.base *= 0.2f;
              mesh.paint(black);
              mesh.box({-0.26f, -0.02f, 0.11f}, {0.26f, 0.015f, 0.44f});
              mesh.box({-0.03f, -0.05f, 0.0f}, {0.03f, -0.02f, 0.3f});
              mesh.box({-0.12f, -0.1f, 0.0f}, {0.12f, 0.08f, 0.015f});
              mesh.place(frame);
            }
            mesh.paint(metal(r));
            mesh.box({-0.22f, d - 0.22f, 0.735f}, {0.22f, d - 0.08f, 0.755f});
            // An angled lamp.
            const float x = -side * (w / 2 - 0.15f);
            mesh.cylinder({x, 0.15f, 0.735f}, 0.08f, 0.02f);
            mesh.tube({{x, 0.15f, 0.75f}, {x, 0.08f, 1.0f}, {x + 0.15f * side, 0.3f, 1.15f}},
                      0.01f);
            mesh.lathe({x + 0.15f * side, 0.3f, 1.05f}, {{0.09f, 0}, {0.03f, 0.12f}}, 14);
            litter(mesh, r, {-w / 2, 0.05f, 0.735f}, {w / 2, d, 0.735f}, things);
          }};
}

Piece piano(Random& random) {
  const float h = random.uniform(1.1f, 1.3f);
  return {1.5f, 0.65f, h, [=](MeshBuilder& mesh, Random& r) {
            mesh.paint(wood(r));
            mesh.box({-0.75f, 0, 0}, {0.75f, 0.32f, h});
            mesh.box({-0.75f, 0.32f, 0.58f}, {0.75f, 0.62f, 0.70f});
            mesh.box({-0.75f, 0.32f, 0}, {-0.68f, 0.62f, 0.58f});
            mesh.box({0.68f, 0.32f, 0}, {0.75f, 0.62f, 0.58f});
            mesh.sheet(
                [&](float u, float v) -> Eigen::Vector3f {
                  return {1.3f * (u - 0.5f), 0.34f + 0.1f * v * v, 0.72f + 0.25f * (1 - v)};
                },
                4, 8);
            Material keys;
            keys.base = {0.9f, 0.9f, 0.85f};
            keys.second = {0.05f, 0.05f, 0.05f};
            keys.pattern = Pattern::stripes;
            keys.scale = 0.03f;
            mesh.paint(keys);
            mesh.box({-0.66f, 0.45f, 0.70f}, {0.66f, 0.6f, 0.72f});
            book_row(mesh, r, -0.6f, 0.1f, 0.02f, 0.2f, h, 0.25f);
            litter(mesh, r, {0.15f, 0.05f, h}, {0.7f, 0.3f, h}, 2);
          }};
}

}  // namespace gpureg::synthetic
