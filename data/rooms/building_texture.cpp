// SPDX-License-Identifier: BSD-3-Clause
#include "data/rooms/building_texture.hpp"

#include <algorithm>
#include <array>
#include <map>
#include <numeric>

#include "data/furniture/furniture.hpp"

namespace gpureg::synthetic {
namespace {

using Eigen::Vector3f;

constexpr std::uint64_t kKey = 2;             // render_colour has the others of this purpose
constexpr std::size_t kMaxMaterials = 32768;  // more parts than these share them

/// The parts of a mesh: triangles whose corners coincide belong together. A number for each
/// triangle, from 0 on in the order of the first triangles.
std::vector<std::size_t> parts_of(const Mesh& mesh) {
  std::map<std::array<float, 3>, std::size_t> places;
  std::vector<std::size_t> root;
  const auto find = [&](std::size_t k) {
    while (root[k] != k) k = root[k] = root[root[k]];
    return k;
  };
  std::vector<std::size_t> place_of_vertex;
  for (const Vector3f& v : mesh.vertices) {
    const auto found = places.try_emplace({v.x(), v.y(), v.z()}, root.size()).first;
    if (found->second == root.size()) root.push_back(found->second);
    place_of_vertex.push_back(found->second);
  }
  for (const auto& t : mesh.triangles) {
    for (const std::uint32_t corner : {t[1], t[2]})
      root[find(place_of_vertex[corner])] = find(place_of_vertex[t[0]]);
  }
  std::map<std::size_t, std::size_t> numbers;
  std::vector<std::size_t> result;
  for (const auto& t : mesh.triangles)
    result.push_back(
        numbers.try_emplace(find(place_of_vertex[t[0]]), numbers.size()).first->second);
  return result;
}

/// What a part of a building may be made of, by what it looks like: large upright ones are walls,
/// large flat ones floors, the others furniture.
struct Shape {
  float upright = 0, flat = 0;  ///< square metres
};

Material material_of(const Shape& shape, Random& random) {
  constexpr float kLarge = 6;  // square metres, of one side; most furniture has less
  Material m;
  if (std::max(shape.upright, shape.flat) < kLarge) {
    m = random.chance(0.5f) ? wood(random) : fabric(random);
    if (random.chance(0.3f)) m.pattern = Pattern::picture;
  } else if (shape.flat > shape.upright) {
    m.pattern = random.chance(0.5f) ? Pattern::planks : Pattern::marble;
    m.scale = random.uniform(0.12f, 0.3f);
  } else {
    m.pattern = Pattern::picture;  // wallpaper: a motif that does not repeat
    m.scale = random.uniform(0.3f, 0.6f);
  }
  return m;
}

}  // namespace

void texture_building(Mesh& mesh, std::uint64_t seed) {
  const std::vector<std::size_t> parts = parts_of(mesh);
  const std::size_t count = parts.empty() ? 0 : *std::max_element(parts.begin(), parts.end()) + 1;
  std::vector<Shape> shapes(count);
  for (std::size_t k = 0; k < parts.size(); ++k) {
    const auto& t = mesh.triangles[k];
    const Vector3f a = mesh.vertices[t[0]];
    const Vector3f area = 0.5f * (mesh.vertices[t[1]] - a).cross(mesh.vertices[t[2]] - a);
    const bool lies = std::abs(area.z()) > 0.7f * area.norm();
    (lies ? shapes[parts[k]].flat : shapes[parts[k]].upright) += area.norm();
  }
  const std::vector<Material> of_file = std::move(mesh.palette);
  mesh.palette.clear();
  std::map<std::pair<std::size_t, std::uint16_t>, std::uint16_t> places;
  for (std::size_t k = 0; k < parts.size(); ++k) {
    const auto place =
        places.try_emplace({parts[k] % kMaxMaterials, mesh.materials[k]},
                           static_cast<std::uint16_t>(mesh.palette.size() % kMaxMaterials));
    if (place.second && mesh.palette.size() < kMaxMaterials) {
      Random random(hash_key(seed, Purpose::texture, kKey, parts[k]));
      Material m = material_of(shapes[parts[k]], random);
      m.base = of_file[mesh.materials[k]].base;
      // Dark colours get a lighter one beside them, others a darker one.
      const float contrast = random.uniform(0.35f, 0.6f);
      m.second = m.base.maxCoeff() < 0.2f ? Vector3f(m.base + Vector3f::Constant(0.5f * contrast))
                                          : Vector3f(contrast * m.base);
      mesh.palette.push_back(m);
    }
    mesh.materials[k] = place.first->second;
  }
}

}  // namespace gpureg::synthetic
