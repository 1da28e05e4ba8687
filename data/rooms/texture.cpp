// SPDX-License-Identifier: BSD-3-Clause
#include "data/rooms/texture.hpp"

#include <algorithm>
#include <cmath>

#include "data/random.hpp"

namespace gpureg::synthetic {
namespace {

using Eigen::Vector2f;
using Eigen::Vector3f;

float lattice(int x, int y, int z, std::uint64_t key) {
  const auto packed = (static_cast<std::uint64_t>(static_cast<std::uint32_t>(x)) << 42) ^
                      (static_cast<std::uint64_t>(static_cast<std::uint32_t>(y)) << 21) ^
                      static_cast<std::uint64_t>(static_cast<std::uint32_t>(z));
  return unit_float(mix64(packed ^ key) >> 40);
}

float smooth_noise(const Vector3f& p, std::uint64_t key) {
  const Vector3f cell = p.array().floor(), f = p - cell;
  const Vector3f w = f.array().square() * (3.0f - 2.0f * f.array());
  const Eigen::Vector3i c = cell.cast<int>();
  float value = 0;
  for (int i = 0; i < 8; ++i) {
    const int dx = i & 1, dy = (i >> 1) & 1, dz = i >> 2;
    value += (dx ? w.x() : 1 - w.x()) * (dy ? w.y() : 1 - w.y()) * (dz ? w.z() : 1 - w.z()) *
             lattice(c.x() + dx, c.y() + dy, c.z() + dz, key);
  }
  return value;
}

/// The two coordinates along the surface: those of the axes that the normal points along least.
Vector2f along_surface(const Vector3f& point, const Vector3f& normal) {
  const Vector3f n = normal.cwiseAbs();
  if (n.z() >= n.x() && n.z() >= n.y()) return {point.x(), point.y()};
  return n.x() > n.y() ? Vector2f(point.y(), point.z()) : Vector2f(point.x(), point.z());
}

float fraction(float x) { return x - std::floor(x); }

/// 1 in the joint between cells of size (1, 1), else 0; rows may be shifted against each other.
float joint(const Vector2f& uv, float shift, float width) {
  const float u = fraction(uv.x() + shift * std::floor(uv.y())), v = fraction(uv.y());
  return u < width || v < width ? 1.0f : 0.0f;
}

/// How much of the second colour, 0 .. 1.
float mixture(const Material& m, const Vector3f& point, const Vector3f& normal, std::uint64_t key) {
  const Vector2f uv = along_surface(point, normal) / m.scale;
  const Vector3f p = point / m.scale;
  switch (m.pattern) {
    case Pattern::plain:
      return 0.15f * fractal_noise(4.0f * p, key);
    case Pattern::plaster:
      return 0.6f * fractal_noise(p, key) + 0.25f * fractal_noise(12.0f * p, key);
    case Pattern::wood:
      return fraction(6.0f * fractal_noise(p.cwiseProduct(Vector3f(0.25f, 2.0f, 2.0f)), key));
    case Pattern::planks: {
      const float board = std::floor(uv.y());
      const float tone =
          lattice(static_cast<int>(board),
                  static_cast<int>(std::floor(0.2f * uv.x() + 0.37f * board)), 0, key);
      const float grain = fractal_noise(Vector3f(0.6f * uv.x(), 9.0f * uv.y(), board), key);
      return std::max(joint(uv.cwiseProduct(Vector2f(0.2f, 1.0f)), 0.37f, 0.03f),
                      0.5f * tone + 0.4f * grain);
    }
    case Pattern::tiles: {
      const float tone = lattice(static_cast<int>(std::floor(uv.x())),
                                 static_cast<int>(std::floor(uv.y())), 7, key);
      return std::max(joint(uv, 0, 0.03f), 0.3f * tone + 0.2f * fractal_noise(5.0f * p, key));
    }
    case Pattern::bricks:
      return std::max(joint(uv.cwiseProduct(Vector2f(0.5f, 1.5f)), 0.5f, 0.06f),
                      0.5f * fractal_noise(6.0f * p, key));
    case Pattern::fabric:
      return 0.5f + 0.25f * std::sin(40.0f * uv.x()) * std::sin(40.0f * uv.y()) +
             0.3f * (fractal_noise(p, key) - 0.5f);
    case Pattern::stripes:
      return fraction(uv.x()) < 0.5f ? 0.9f : 0.1f * fractal_noise(8.0f * p, key);
    case Pattern::marble:
      return 0.5f + 0.5f * std::sin(3.0f * p.x() + 2.0f * p.z() + 9.0f * fractal_noise(p, key));
    case Pattern::leaf:
      return fractal_noise(6.0f * p, key);
    case Pattern::picture:
      return fraction(3.0f * fractal_noise(2.0f * p, key));
  }
  return 0;
}

}  // namespace

float fractal_noise(const Vector3f& p, std::uint64_t key) {
  float sum = 0, amplitude = 0.5333333f, frequency = 1;
  for (int octave = 0; octave < 4; ++octave) {
    sum += amplitude * smooth_noise(frequency * p, key + static_cast<std::uint64_t>(octave));
    amplitude *= 0.5f;
    frequency *= 2.03f;  // not 2: the lattices of the octaves shall not coincide
  }
  return sum;
}

Vector3f surface_colour(const Material& material, const Vector3f& point, const Vector3f& normal,
                        std::uint64_t key) {
  const float t = std::clamp(mixture(material, point, normal, key), 0.0f, 1.0f);
  return (1 - t) * material.base + t * material.second;
}

}  // namespace gpureg::synthetic
