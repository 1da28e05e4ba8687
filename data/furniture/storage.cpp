// SPDX-License-Identifier: BSD-3-Clause
#include "data/furniture/furniture.hpp"

namespace gpureg::synthetic {
namespace {

void handle(MeshBuilder& mesh, float x, float y, float z, float length) {
  mesh.tube({{x, y, z}, {x, y + 0.03f, z}, {x, y + 0.03f, z + length}, {x, y, z + length}}, 0.007f);
}

/// Doors side by side on a body whose front is at y = depth; each stands out a little, by its own
/// amount.
void doors(MeshBuilder& mesh, Random& r, float w, float depth, float bottom, float top, int count) {
  const float step = w / static_cast<float>(count);
  for (int i = 0; i < count; ++i) {
    const float left = -w / 2 + step * static_cast<float>(i), out = r.uniform(0.014f, 0.03f);
    mesh.box({left + 0.008f, depth, bottom + 0.01f},
             {left + step - 0.008f, depth + out, top - 0.01f});
    if (r.chance(0.6f)) {
      mesh.box({left + 0.07f, depth + out, bottom + 0.08f},
               {left + step - 0.07f, depth + out + 0.012f, top - 0.08f});
    }
    handle(mesh, left + (i % 2 ? 0.05f : step - 0.05f), depth + out, 0.5f * (bottom + top), 0.12f);
  }
}

}  // namespace

Piece bookshelf(Random& random) {
  const float w = random.uniform(0.7f, 1.5f), d = random.uniform(0.26f, 0.36f),
              h = random.uniform(1.4f, 2.1f);
  const int boards = random.between(4, 6), columns = w > 1.1f ? 2 : 1;
  return {w, d, h, [=](MeshBuilder& mesh, Random& r) {
            mesh.paint(wood(r));
            mesh.box({-w / 2, 0, 0}, {w / 2, 0.012f, h});
            for (int i = 0; i <= columns; ++i) {
              const float x =
                  -w / 2 + (w - 0.025f) * static_cast<float>(i) / static_cast<float>(columns);
              mesh.box({x, 0, 0}, {x + 0.025f, d, h});
            }
            const float step = (h - 0.1f) / static_cast<float>(boards);
            for (int i = 0; i <= boards; ++i) {
              const float z = 0.07f + step * static_cast<float>(i);
              mesh.box({-w / 2, 0, z}, {w / 2, d, z + 0.022f});
            }
            for (int i = 0; i < boards; ++i) {
              for (int c = 0; c < columns; ++c) {
                const float left =
                    -w / 2 + 0.03f +
                    (w - 0.025f) / static_cast<float>(columns) * static_cast<float>(c);
                const float right = left + (w - 0.06f) / static_cast<float>(columns) - 0.02f;
                const float z = 0.092f + step * static_cast<float>(i);
                const float kind = r.uniform();
                if (kind < 0.65f) {
                  book_row(mesh, r, left, left + (right - left) * r.uniform(0.4f, 1.0f), 0.02f,
                           d - 0.04f, z, step - 0.05f);
                } else if (kind < 0.9f) {
                  litter(mesh, r, {left, 0.04f, z}, {right, d - 0.02f, z}, 2);
                }
              }
            }
            litter(mesh, r, {-w / 2, 0.02f, h}, {w / 2, d, h}, 2);
          }};
}

Piece wardrobe(Random& random) {
  const float w = random.uniform(0.9f, 1.9f), d = random.uniform(0.52f, 0.62f),
              h = random.uniform(1.8f, 2.2f);
  return {w, d, h, [=](MeshBuilder& mesh, Random& r) {
            const bool painted = r.chance(0.5f);
            mesh.paint(painted ? paint(r) : wood(r));
            mesh.box({-w / 2, 0, 0.06f}, {w / 2, d - 0.03f, h});
            mesh.box({-w / 2 + 0.03f, 0.03f, 0}, {w / 2 - 0.03f, d - 0.08f, 0.06f});
            mesh.box({-w / 2 - 0.02f, 0, h}, {w / 2 + 0.02f, d + 0.01f, h + 0.04f});
            doors(mesh, r, w, d - 0.03f, 0.08f, h - 0.02f, w > 1.4f ? 3 : 2);
            litter(mesh, r, {-w / 2, 0.05f, h + 0.04f}, {w / 2, d - 0.05f, h + 0.04f}, 2);
          }};
}

Piece sideboard(Random& random) {
  const float w = random.uniform(1.0f, 1.8f), d = random.uniform(0.38f, 0.5f),
              h = random.uniform(0.5f, 0.95f);
  const bool screen = random.chance(0.45f);
  return {w, d, screen ? h + 0.7f : h, [=](MeshBuilder& mesh, Random& r) {
            mesh.paint(wood(r));
            mesh.box({-w / 2, 0, 0.1f}, {w / 2, d - 0.03f, h - 0.03f});
            mesh.box({-w / 2 - 0.01f, 0, h - 0.03f}, {w / 2 + 0.01f, d, h});
            doors(mesh, r, w, d - 0.03f, 0.12f, h - 0.04f, r.between(2, 4));
            for (const float x : {-w / 2 + 0.06f, w / 2 - 0.06f}) {
              for (const float y : {0.05f, d - 0.08f}) mesh.cylinder({x, y, 0}, 0.02f, 0.1f, 8);
            }
            if (screen) {
              Material black = metal(r);
              black.base *= 0.15f;
              mesh.paint(black);
              const float half = r.uniform(0.4f, 0.55f);
              mesh.box({-half, d / 2 - 0.03f, h + 0.06f},
                       {half, d / 2 + 0.02f, h + 0.06f + 1.15f * half});
              mesh.box({-0.2f, d / 2 - 0.1f, h}, {0.2f, d / 2 + 0.1f, h + 0.02f});
              mesh.box({-0.04f, d / 2 - 0.05f, h}, {0.04f, d / 2 - 0.02f, h + 0.3f});
              litter(mesh, r, {half, 0.05f, h}, {w / 2, d, h}, 1);
            } else {
              litter(mesh, r, {-w / 2, 0.05f, h}, {w / 2, d, h}, r.between(2, 6));
            }
          }};
}

Piece kitchen_counter(Random& random) {
  const int units = random.between(3, 5);
  const float w = 0.6f * static_cast<float>(units), d = 0.62f;
  const int sink = random.below(units), stove = random.below(units);
  return {w, d, 2.1f, [=](MeshBuilder& mesh, Random& r) {
            const Material front = r.chance(0.5f) ? paint(r) : wood(r);
            mesh.paint(front);
            mesh.box({-w / 2, 0, 0.1f}, {w / 2, d - 0.04f, 0.87f});
            doors(mesh, r, w, d - 0.04f, 0.12f, 0.86f, units);
            // Upper cupboards, with a gap for the hood.
            for (int i = 0; i < units; ++i) {
              const float left = -w / 2 + 0.6f * static_cast<float>(i);
              if (i == stove) {
                mesh.sheet(
                    [&](float u, float v) -> Eigen::Vector3f {
                      const float half = 0.28f - 0.16f * v;
                      return {left + 0.3f + (2 * u - 1) * half, 0.45f - 0.25f * v,
                              1.55f + 0.5f * v};
                    },
                    4, 6);
                mesh.box({left + 0.02f, 0, 1.5f}, {left + 0.58f, 0.45f, 1.55f});
                mesh.box({left + 0.2f, 0, 1.55f}, {left + 0.4f, 0.2f, 2.4f});
              } else if (r.chance(0.8f)) {
                mesh.box({left + 0.005f, 0, 1.45f}, {left + 0.595f, 0.33f, 2.1f});
                mesh.box({left + 0.02f, 0.33f, 1.46f}, {left + 0.58f, 0.35f, 2.09f});
                handle(mesh, left + 0.08f, 0.35f, 1.5f, 0.12f);
              }
            }
            Material top;
            top.pattern = Pattern::marble;
            top.base = {0.35f, 0.33f, 0.32f};
            top.second = {0.6f, 0.58f, 0.55f};
            top.scale = 0.4f;
            mesh.paint(top);
            mesh.box({-w / 2, 0, 0.87f}, {w / 2, d, 0.91f});
            mesh.paint(metal(r));
            const float basin = -w / 2 + 0.6f * static_cast<float>(sink) + 0.3f;
            mesh.lathe({basin, 0.32f, 0.91f},
                       {{0.21f, 0.02f}, {0.19f, 0.02f}, {0.19f, 0.003f}, {0, 0.003f}}, 24);
            mesh.tube({{basin, 0.08f, 0.91f},
                       {basin, 0.08f, 1.12f},
                       {basin, 0.13f, 1.18f},
                       {basin, 0.22f, 1.18f},
                       {basin, 0.25f, 1.12f}},
                      0.013f, 8);
            const float plate = -w / 2 + 0.6f * static_cast<float>(stove) + 0.3f;
            for (int i = 0; i < 2; ++i) {
              const float x = plate + (i ? 0.14f : -0.14f), y = r.uniform(0.2f, 0.42f),
                          radius = r.uniform(0.08f, 0.13f);
              const float h = r.uniform(0.06f, 0.2f);
              mesh.lathe({x, y, 0.91f},
                         {{0, 0},
                          {radius, 0},
                          {radius, h},
                          {radius - 0.01f, h},
                          {radius - 0.01f, 0.02f},
                          {0, 0.02f}},
                         20);
              mesh.tube({{x, y + radius, 0.9f + h}, {x, y + radius + 0.15f, 0.92f + h}}, 0.01f);
            }
            litter(mesh, r, {-w / 2, 0.05f, 0.91f}, {w / 2, 0.3f, 0.91f}, units + 1);
          }};
}

Piece fridge(Random& random) {
  const float h = random.uniform(1.4f, 1.9f), w = random.uniform(0.58f, 0.7f);
  return {w, 0.66f, h, [=](MeshBuilder& mesh, Random& r) {
            mesh.paint(r.chance(0.6f) ? metal(r) : paint(r));
            mesh.box({-w / 2, 0.02f, 0.02f}, {w / 2, 0.58f, h});
            const float split = 0.36f * h;
            for (const auto& [low, high] : {std::pair{0.06f, split}, std::pair{split + 0.01f, h}}) {
              mesh.cushion({-w / 2, 0.56f, low}, {w / 2, 0.65f, high}, 0.12f);
              handle(mesh, w / 2 - 0.07f, 0.65f, high - 0.35f, 0.25f);
            }
            litter(mesh, r, {-w / 2, 0.1f, h}, {w / 2, 0.5f, h}, 2);
          }};
}

}  // namespace gpureg::synthetic
