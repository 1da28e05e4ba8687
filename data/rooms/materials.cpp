// SPDX-License-Identifier: BSD-3-Clause
#include "data/furniture/furniture.hpp"

namespace gpureg::synthetic {
namespace {

using Eigen::Vector3f;

/// A hue circle, good enough for paint and cloth.
Vector3f hue(float angle, float saturation, float value) {
  const auto channel = [&](float shift) {
    return value * (1 - saturation * (0.5f - 0.5f * std::cos(angle + shift)));
  };
  return {channel(0), channel(2.0944f), channel(4.1888f)};
}

}  // namespace

Material wood(Random& random) {
  const float tone = random.uniform(0.25f, 1.0f);
  Material m;
  m.pattern = Pattern::wood;
  m.base = tone * Vector3f(0.62f, 0.42f, 0.24f);
  m.second = tone * Vector3f(0.42f, 0.26f, 0.13f);
  m.scale = random.uniform(0.15f, 0.35f);
  return m;
}

Material fabric(Random& random) {
  Material m;
  m.pattern = random.chance(0.25f) ? Pattern::stripes : Pattern::fabric;
  m.base = hue(random.uniform(0, 6.28f), random.uniform(0.2f, 0.8f), random.uniform(0.25f, 0.8f));
  m.second = random.uniform(0.4f, 1.3f) * m.base;
  m.scale = random.uniform(0.06f, 0.2f);
  return m;
}

Material paint(Random& random) {
  Material m;
  m.base = hue(random.uniform(0, 6.28f), random.uniform(0.1f, 0.9f), random.uniform(0.3f, 0.9f));
  m.second = 0.6f * m.base;
  return m;
}

Material metal(Random& random) {
  Material m;
  m.base = Vector3f::Constant(random.uniform(0.25f, 0.6f));
  m.second = 1.2f * m.base;
  m.scale = 0.3f;
  return m;
}

}  // namespace gpureg::synthetic
