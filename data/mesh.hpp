// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Geometry>
#include <array>
#include <cstdint>
#include <functional>
#include <vector>

namespace gpureg::synthetic {

/// How a surface is coloured: two colours and the pattern that mixes them (texture.hpp).
enum class Pattern : std::uint8_t {
  plain,
  plaster,
  wood,
  planks,
  tiles,
  bricks,
  fabric,
  stripes,
  marble,
  leaf,
  picture
};

struct Material {
  Pattern pattern = Pattern::plain;
  Eigen::Vector3f base{0.8f, 0.8f, 0.8f}, second{0.6f, 0.6f, 0.6f};  ///< linear RGB, 0 .. 1
  float scale = 0.1f;                                                ///< metres per repetition
};

struct Mesh {
  std::vector<Eigen::Vector3f> vertices;  ///< world, metres
  std::vector<std::array<std::uint32_t, 3>> triangles;
  std::vector<std::uint16_t> materials;  ///< per triangle, an index into palette
  std::vector<Material> palette;
};

/// Adds primitives to a mesh, in the frame of the object that is being built (z up). Surfaces are
/// seen from both sides.
class MeshBuilder {
 public:
  explicit MeshBuilder(Mesh& mesh) : mesh_(mesh) {}

  /// Where the following primitives go: world_from_object.
  void place(const Eigen::Affine3f& world_from_object) { frame_ = world_from_object; }
  const Eigen::Affine3f& frame() const { return frame_; }
  /// Material of the following primitives.
  void paint(const Material& material);

  void quad(const Eigen::Vector3f& a, const Eigen::Vector3f& b, const Eigen::Vector3f& c,
            const Eigen::Vector3f& d);
  void box(const Eigen::Vector3f& low, const Eigen::Vector3f& high);
  /// Surface of revolution around the z axis through centre: profile is (radius, height) from
  /// bottom to top.
  void lathe(const Eigen::Vector3f& centre, const std::vector<Eigen::Vector2f>& profile,
             int segments = 20);
  void cylinder(const Eigen::Vector3f& base_centre, float radius, float height, int segments = 16);
  void ellipsoid(const Eigen::Vector3f& centre, const Eigen::Vector3f& radii);
  /// A box with swollen faces and round edges: cushions, pillows, mattresses.
  void cushion(const Eigen::Vector3f& low, const Eigen::Vector3f& high, float roundness = 0.5f);
  /// A pipe along a polyline.
  void tube(const std::vector<Eigen::Vector3f>& line, float radius, int segments = 6);
  /// A surface over [0, 1]^2.
  void sheet(const std::function<Eigen::Vector3f(float, float)>& point, int columns, int rows);

 private:
  std::uint32_t vertex(const Eigen::Vector3f& p);
  void triangle(std::uint32_t a, std::uint32_t b, std::uint32_t c);
  /// Connects a (rows + 1) x (columns + 1) grid of vertices that starts at first.
  void connect_grid(std::uint32_t first, int columns, int rows);

  Mesh& mesh_;
  Eigen::Affine3f frame_ = Eigen::Affine3f::Identity();
  std::uint16_t material_ = 0;
};

/// A vertical turn by yaw (radians) at a place: the usual frame of furniture.
inline Eigen::Affine3f upright(const Eigen::Vector3f& origin, float yaw) {
  return Eigen::Translation3f(origin) * Eigen::AngleAxisf(yaw, Eigen::Vector3f::UnitZ());
}

}  // namespace gpureg::synthetic
