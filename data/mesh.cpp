// SPDX-License-Identifier: BSD-3-Clause
#include "data/mesh.hpp"

#include <cmath>

namespace gpureg::synthetic {
namespace {

constexpr float kPi = 3.14159265f;

float signed_power(float x, float exponent) {
  return std::copysign(std::pow(std::abs(x), exponent), x);
}

}  // namespace

using Eigen::Vector2f;
using Eigen::Vector3f;

void MeshBuilder::paint(const Material& material) {
  material_ = static_cast<std::uint16_t>(mesh_.palette.size());
  mesh_.palette.push_back(material);
}

std::uint32_t MeshBuilder::vertex(const Vector3f& p) {
  mesh_.vertices.push_back(frame_ * p);
  return static_cast<std::uint32_t>(mesh_.vertices.size() - 1);
}

void MeshBuilder::triangle(std::uint32_t a, std::uint32_t b, std::uint32_t c) {
  mesh_.triangles.push_back({a, b, c});
  mesh_.materials.push_back(material_);
}

void MeshBuilder::connect_grid(std::uint32_t first, int columns, int rows) {
  const auto width = static_cast<std::uint32_t>(columns + 1);
  for (std::uint32_t row = 0; row < static_cast<std::uint32_t>(rows); ++row) {
    for (std::uint32_t column = 0; column + 1 < width; ++column) {
      const std::uint32_t a = first + row * width + column;
      triangle(a, a + 1, a + width + 1);
      triangle(a, a + width + 1, a + width);
    }
  }
}

void MeshBuilder::quad(const Vector3f& a, const Vector3f& b, const Vector3f& c, const Vector3f& d) {
  const std::uint32_t first = vertex(a);
  vertex(b);
  vertex(c);
  vertex(d);
  triangle(first, first + 1, first + 2);
  triangle(first, first + 2, first + 3);
}

void MeshBuilder::box(const Vector3f& low, const Vector3f& high) {
  const auto corner = [&](int i) {
    return Vector3f(i & 1 ? high.x() : low.x(), i & 2 ? high.y() : low.y(),
                    i & 4 ? high.z() : low.z());
  };
  quad(corner(0), corner(2), corner(3), corner(1));
  quad(corner(4), corner(5), corner(7), corner(6));
  quad(corner(0), corner(1), corner(5), corner(4));
  quad(corner(2), corner(6), corner(7), corner(3));
  quad(corner(0), corner(4), corner(6), corner(2));
  quad(corner(1), corner(3), corner(7), corner(5));
}

void MeshBuilder::lathe(const Vector3f& centre, const std::vector<Vector2f>& profile,
                        int segments) {
  const auto first = static_cast<std::uint32_t>(mesh_.vertices.size());
  for (const Vector2f& ring : profile) {
    for (int s = 0; s <= segments; ++s) {
      const float angle = 2 * kPi * static_cast<float>(s % segments) / static_cast<float>(segments);
      vertex(centre + Vector3f(ring.x() * std::cos(angle), ring.x() * std::sin(angle), ring.y()));
    }
  }
  connect_grid(first, segments, static_cast<int>(profile.size()) - 1);
}

void MeshBuilder::cylinder(const Vector3f& base_centre, float radius, float height, int segments) {
  lathe(base_centre, {{0, 0}, {radius, 0}, {radius, height}, {0, height}}, segments);
}

void MeshBuilder::ellipsoid(const Vector3f& centre, const Vector3f& radii) {
  sheet(
      [&](float u, float v) -> Vector3f {
        const float longitude = 2 * kPi * u, latitude = kPi * (v - 0.5f);
        return centre + radii.cwiseProduct(Vector3f(std::cos(latitude) * std::cos(longitude),
                                                    std::cos(latitude) * std::sin(longitude),
                                                    std::sin(latitude)));
      },
      20, 12);
}

void MeshBuilder::cushion(const Vector3f& low, const Vector3f& high, float roundness) {
  // A superellipsoid: exponents near 0 make a box, 1 makes an ellipsoid.
  const Vector3f centre = 0.5f * (low + high), radii = 0.5f * (high - low);
  const float vertical = roundness, horizontal = 0.6f * roundness;
  sheet(
      [&](float u, float v) -> Vector3f {
        const float longitude = 2 * kPi * u, latitude = kPi * (v - 0.5f);
        const float ring = signed_power(std::cos(latitude), vertical);
        return centre +
               radii.cwiseProduct(Vector3f(ring * signed_power(std::cos(longitude), horizontal),
                                           ring * signed_power(std::sin(longitude), horizontal),
                                           signed_power(std::sin(latitude), vertical)));
      },
      32, 14);
}

void MeshBuilder::tube(const std::vector<Vector3f>& line, float radius, int segments) {
  const auto first = static_cast<std::uint32_t>(mesh_.vertices.size());
  for (std::size_t i = 0; i < line.size(); ++i) {
    const Vector3f along =
        (line[std::min(i + 1, line.size() - 1)] - line[i == 0 ? 0 : i - 1]).normalized();
    const Vector3f helper =
        std::abs(along.z()) < 0.9f ? Vector3f(Vector3f::UnitZ()) : Vector3f(Vector3f::UnitX());
    const Vector3f side = along.cross(helper).normalized(), up = side.cross(along);
    for (int s = 0; s <= segments; ++s) {
      const float angle = 2 * kPi * static_cast<float>(s) / static_cast<float>(segments);
      vertex(line[i] + radius * (std::cos(angle) * side + std::sin(angle) * up));
    }
  }
  connect_grid(first, segments, static_cast<int>(line.size()) - 1);
}

void MeshBuilder::sheet(const std::function<Vector3f(float, float)>& point, int columns, int rows) {
  const auto first = static_cast<std::uint32_t>(mesh_.vertices.size());
  for (int r = 0; r <= rows; ++r) {
    for (int c = 0; c <= columns; ++c) {
      vertex(point(static_cast<float>(c) / static_cast<float>(columns),
                   static_cast<float>(r) / static_cast<float>(rows)));
    }
  }
  connect_grid(first, columns, rows);
}

}  // namespace gpureg::synthetic
