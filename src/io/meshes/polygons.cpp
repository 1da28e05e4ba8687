// SPDX-License-Identifier: BSD-3-Clause
#include "io/meshes/polygons.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <sstream>
#include <string>

namespace gpureg::io {
namespace {

using Triangle = std::array<std::uint32_t, 3>;
using Corners = std::vector<Eigen::Vector2d>;

/// Ears are looked for in quadratic time.
constexpr std::size_t kMostEars = 500;
/// Corners that are tried, per corner of the polygon. A simple polygon needs about two.
constexpr std::size_t kTries = 8;

double cross(const Eigen::Vector2d& a, const Eigen::Vector2d& b, const Eigen::Vector2d& c) {
  return (b.x() - a.x()) * (c.y() - a.y()) - (b.y() - a.y()) * (c.x() - a.x());
}

/// The polygon without the axis that its normal is closest to, counter-clockwise.
Corners flattened(const std::vector<Eigen::Vector3d>& corners) {
  Eigen::Vector3d normal = Eigen::Vector3d::Zero();
  for (std::size_t k = 1; k + 1 < corners.size(); ++k)
    normal += (corners[k] - corners[0]).cross(corners[k + 1] - corners[0]);
  Eigen::Index axis = 0;
  normal.cwiseAbs().maxCoeff(&axis);
  Eigen::Index u = (axis + 1) % 3, v = (axis + 2) % 3;
  if (normal[axis] < 0) std::swap(u, v);
  Corners out;
  for (const Eigen::Vector3d& p : corners) out.emplace_back(p[u], p[v]);
  return out;
}

bool is_convex(const Corners& p) {
  for (std::size_t k = 0; k < p.size(); ++k)
    if (!(cross(p[k], p[(k + 1) % p.size()], p[(k + 2) % p.size()]) > 0)) return false;
  return true;
}

/// Cuts ears off a ring of corners until a triangle is left.
class EarCutter {
 public:
  explicit EarCutter(Corners corners) : p_(std::move(corners)) {
    for (std::size_t k = 0; k < p_.size(); ++k) ring_.push_back(k);
  }

  template <typename Take>
  void cut(Take&& take) {
    std::size_t at = 0;
    for (std::size_t tries = kTries * p_.size(); ring_.size() > 3 && tries > 0; --tries) {
      at %= ring_.size();
      if (!is_ear(at)) {
        ++at;
        continue;
      }
      take(place(at + ring_.size() - 1), place(at), place(at + 1));
      ring_.erase(ring_.begin() + static_cast<std::ptrdiff_t>(at));
      at += ring_.size() - 1;  // the corner before may be an ear now
    }
    // More than three are left of a polygon that cuts itself: nothing is right then.
    for (std::size_t k = 1; k + 1 < ring_.size(); ++k) take(ring_[0], ring_[k], ring_[k + 1]);
  }

 private:
  std::size_t place(std::size_t at) const { return ring_[at % ring_.size()]; }

  bool is_ear(std::size_t at) const {
    const Eigen::Vector2d &a = p_[place(at + ring_.size() - 1)], &b = p_[place(at)],
                          &c = p_[place(at + 1)];
    if (!(cross(a, b, c) > 0)) return false;
    return std::none_of(ring_.begin(), ring_.end(), [&](std::size_t k) {
      const Eigen::Vector2d& q = p_[k];
      return q != a && q != b && q != c && cross(a, b, q) >= 0 && cross(b, c, q) >= 0 &&
             cross(c, a, q) >= 0;
    });
  }

  Corners p_;
  std::vector<std::size_t> ring_;
};

std::string text_of(const Eigen::Vector3d& p) {
  std::ostringstream text;
  text << p.transpose();
  return text.str();
}

}  // namespace

void Polygons::add_corner(double vertex, const Source& source) {
  if (!(vertex >= 0 && vertex < 4294967295.0 && std::floor(vertex) == vertex)) {
    std::ostringstream text;
    text << "face " << ends.size() + 1 << " has the vertex " << vertex
         << ", expected a whole number from 0 to 2^32 - 2";
    source.fail(text.str());
  }
  corners.push_back(static_cast<std::uint32_t>(vertex));
}

void check_corners(const Polygons& polygons, const Source& source, std::size_t first) {
  std::size_t face = 0;
  for (std::size_t k = 0; k < polygons.corners.size(); ++k) {
    while (polygons.ends[face] <= k) ++face;
    const std::size_t vertex = polygons.corners[k];
    const std::string where =
        "face " + std::to_string(face + 1) + " has vertex " + std::to_string(vertex + first);
    if (vertex >= polygons.vertices.size())
      source.fail(where + ", but there are " + std::to_string(polygons.vertices.size()) +
                  " vertices");
    if (!polygons.vertices[vertex].cast<float>().allFinite())
      source.fail(where + " at " + text_of(polygons.vertices[vertex]) +
                  ", expected finite coordinates of float32");
  }
}

std::vector<Triangle> triangles_of(const Polygons& polygons, const Source& source) {
  std::vector<Triangle> out;
  std::vector<Eigen::Vector3d> corners;
  std::size_t begin = 0;
  for (std::size_t face = 0; face < polygons.ends.size(); begin = polygons.ends[face++]) {
    const std::uint32_t* const first = polygons.corners.data() + begin;
    const std::size_t size = polygons.ends[face] - begin;
    const auto take = [&](std::size_t a, std::size_t b, std::size_t c) {
      out.push_back({first[a], first[b], first[c]});
    };
    if (size == 3) take(0, 1, 2);
    if (size <= 3) continue;
    corners.clear();
    for (std::size_t k = 0; k < size; ++k) corners.push_back(polygons.vertices[first[k]]);
    Corners flat = flattened(corners);
    if (is_convex(flat)) {
      for (std::size_t k = 1; k + 1 < size; ++k) take(0, k, k + 1);
      continue;
    }
    if (size > kMostEars)
      source.fail("face " + std::to_string(face + 1) + " is not convex and has " +
                  std::to_string(size) + " corners, expected at most " + std::to_string(kMostEars));
    EarCutter(std::move(flat)).cut(take);
  }
  return out;
}

}  // namespace gpureg::io
