// SPDX-License-Identifier: BSD-3-Clause
#include <cmath>

#include "data/furniture/furniture.hpp"

namespace gpureg::synthetic {

using Eigen::Vector3f;

void picture(MeshBuilder& mesh, Random& random, float x, float z, float width, float height) {
  const float out = random.uniform(0.01f, 0.025f), rim = random.uniform(0.015f, 0.05f);
  mesh.paint(wood(random));
  mesh.box({x - width / 2, 0, z}, {x + width / 2, out, z + rim});
  mesh.box({x - width / 2, 0, z + height - rim}, {x + width / 2, out, z + height});
  mesh.box({x - width / 2, 0, z}, {x - width / 2 + rim, out, z + height});
  mesh.box({x + width / 2 - rim, 0, z}, {x + width / 2, out, z + height});
  Material canvas = paint(random);
  canvas.second = paint(random).base;
  canvas.pattern = Pattern::picture;
  canvas.scale = 0.4f;
  mesh.paint(canvas);
  mesh.box({x - width / 2, 0, z}, {x + width / 2, 0.5f * out, z + height});
}

void radiator(MeshBuilder& mesh, Random& random, float x, float width) {
  Material white;
  white.base = {0.85f, 0.85f, 0.82f};
  mesh.paint(white);
  const int fins = static_cast<int>(width / 0.06f);
  for (int i = 0; i < fins; ++i) {
    const float left = x - width / 2 + 0.06f * static_cast<float>(i);
    mesh.box({left, 0.04f, 0.12f}, {left + 0.035f, 0.13f, 0.68f});
  }
  mesh.tube({{x - width / 2, 0.085f, 0.18f}, {x + width / 2, 0.085f, 0.18f}}, 0.018f);
  mesh.tube({{x - width / 2, 0.085f, 0.62f}, {x + width / 2, 0.085f, 0.62f}}, 0.018f);
  mesh.tube({{x + width / 2, 0.085f, 0.18f},
             {x + width / 2 + 0.06f, 0.085f, 0.18f},
             {x + width / 2 + 0.06f, 0.085f, 0}},
            0.012f);
  if (random.chance(0.5f))
    mesh.box({x - width / 2 - 0.1f, 0, 0.8f}, {x + width / 2 + 0.1f, 0.2f, 0.83f});
}

void curtain(MeshBuilder& mesh, Random& random, float x, float width, float top) {
  mesh.paint(fabric(random));
  const float waves = random.uniform(40, 60), phase = random.uniform(0, 6),
              bottom = random.uniform(0.03f, 0.2f);
  mesh.sheet(
      [&](float u, float v) -> Vector3f {
        const float fold = 0.035f * (0.4f + 0.6f * v) *
                           std::sin(waves * width * u + phase + 0.8f * std::sin(3 * v + 5 * u));
        return {x + width * (u - 0.5f), 0.14f + fold, top + (bottom - top) * v};
      },
      static_cast<int>(60 * width) + 8, 8);
  mesh.paint(metal(random));
  mesh.tube({{x - width, 0.14f, top + 0.02f}, {x + width, 0.14f, top + 0.02f}}, 0.012f);
}

void wall_shelf(MeshBuilder& mesh, Random& random, float x, float z, float width) {
  const float depth = random.uniform(0.18f, 0.28f);
  mesh.paint(wood(random));
  mesh.box({x - width / 2, 0, z}, {x + width / 2, depth, z + 0.025f});
  for (const float at : {x - 0.4f * width, x + 0.4f * width}) {
    mesh.tube({{at, 0.01f, z - 0.18f}, {at, depth - 0.02f, z}}, 0.01f);
  }
  const float middle = x + random.uniform(-0.1f, 0.3f) * width;
  book_row(mesh, random, x - width / 2 + 0.03f, middle, 0.01f, depth - 0.03f, z + 0.025f, 0.28f);
  litter(mesh, random, {middle, 0.02f, z + 0.025f}, {x + width / 2, depth, z + 0.025f}, 2);
}

void coat_rack(MeshBuilder& mesh, Random& random, float x) {
  mesh.paint(wood(random));
  mesh.box({x - 0.4f, 0, 1.65f}, {x + 0.4f, 0.025f, 1.75f});
  for (int i = 0; i < 5; ++i) {
    const float at = x - 0.34f + 0.17f * static_cast<float>(i);
    mesh.paint(metal(random));
    mesh.tube({{at, 0.02f, 1.7f}, {at, 0.08f, 1.68f}, {at, 0.09f, 1.73f}}, 0.008f);
    if (!random.chance(0.65f)) continue;
    mesh.paint(fabric(random));  // a coat: a folded lathe that hangs from the hook
    const float length = random.uniform(0.6f, 1.0f), girth = random.uniform(0.08f, 0.13f),
                folds = static_cast<float>(random.between(3, 6));
    mesh.sheet(
        [&](float u, float v) -> Vector3f {
          const float a = 6.2831853f * u, r = girth * (0.35f + 0.65f * std::sqrt(v)) *
                                              (1 + 0.18f * std::sin(folds * a));
          return {at + r * std::cos(a), 0.11f + 0.7f * r * std::sin(a), 1.72f - length * v};
        },
        28, 10);
  }
}

}  // namespace gpureg::synthetic
