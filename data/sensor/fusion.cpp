// SPDX-License-Identifier: BSD-3-Clause
#include "data/sensor/fusion.hpp"

#include <algorithm>
#include <cmath>

#include "data/random.hpp"

namespace gpureg::synthetic {
namespace {

using Eigen::Vector3f;
using Eigen::Vector3i;

// metres on each side: wider than the noise at 4 m, narrower than most furniture is thick
constexpr float kTruncation = 0.04f;

std::size_t inside(const Vector3i& v) {
  return static_cast<std::size_t>((v.x() & 7) | ((v.y() & 7) << 3) | ((v.z() & 7) << 6));
}
Vector3i block_of(const Vector3i& v) { return {v.x() >> 3, v.y() >> 3, v.z() >> 3}; }

}  // namespace

std::uint64_t FusionVolume::pack(const Vector3i& block) {
  const auto part = [](int x) { return static_cast<std::uint64_t>(x + (1 << 20)) & 0x1FFFFFu; };
  return part(block.x()) | (part(block.y()) << 21) | (part(block.z()) << 42);
}

std::uint32_t FusionVolume::find(std::uint64_t key) const {
  for (std::size_t i = mix64(key) & (slots_.size() - 1);; i = (i + 1) & (slots_.size() - 1)) {
    if (slots_[i].block == kEmpty || slots_[i].key == key) return slots_[i].block;
  }
}

std::uint32_t FusionVolume::find_or_make(const Vector3i& block) {
  const std::uint64_t key = pack(block);
  std::size_t i = mix64(key) & (slots_.size() - 1);
  for (; slots_[i].block != kEmpty; i = (i + 1) & (slots_.size() - 1)) {
    if (slots_[i].key == key) return slots_[i].block;
  }
  const auto made = static_cast<std::uint32_t>(blocks_.size());
  slots_[i] = {key, made};
  blocks_.push_back({block, {}});
  if (2 * blocks_.size() > slots_.size()) grow();
  return made;
}

void FusionVolume::grow() {
  const std::vector<Slot> old(slots_.size() * 2, Slot{});
  slots_ = old;
  for (std::uint32_t b = 0; b < blocks_.size(); ++b) {
    const std::uint64_t key = pack(blocks_[b].coordinate);
    std::size_t i = mix64(key) & (slots_.size() - 1);
    while (slots_[i].block != kEmpty) i = (i + 1) & (slots_.size() - 1);
    slots_[i] = {key, b};
  }
}

const FusionVolume::Voxel* FusionVolume::voxel(const Vector3i& v) const {
  const std::uint32_t block = find(pack(block_of(v)));
  return block == kEmpty ? nullptr : &blocks_[block].voxels[inside(v)];
}

void FusionVolume::integrate(const DepthQuarter& image,
                             const Eigen::Isometry3d& fragment_from_camera) {
  const Eigen::Matrix3f rotation = fragment_from_camera.rotation().cast<float>();
  const Vector3f origin = fragment_from_camera.translation().cast<float>();
  Vector3i last_block(1 << 30, 0, 0);
  std::uint32_t last = kEmpty;
  const int steps = static_cast<int>(std::lround(2 * kTruncation / voxel_));
  for (int row = 0; row < DepthQuarter::kHeight; ++row) {
    for (int column = 0; column < DepthQuarter::kWidth; ++column) {
      const float z = image.depth[static_cast<std::size_t>(row) * DepthQuarter::kWidth +
                                  static_cast<std::size_t>(column)];
      if (z <= 0) continue;
      const Vector3f ray = rotation * camera::ray(image.pixel_x(column), image.pixel_y(row));
      const float length = ray.norm(), range = z * length;
      const Vector3f unit = ray / length;
      const float weight =
          1.0f /
          std::max(0.25f,
                   z * z);  // the disparity step grows with z^2; its square root's share is bias
      Vector3i before(1 << 30, 0, 0);
      for (int k = 0; k <= steps; ++k) {
        const Vector3f at = origin + (range - kTruncation + voxel_ * static_cast<float>(k)) * unit;
        const Vector3i v = (at / voxel_).array().floor().cast<int>();
        if (v == before) continue;
        before = v;
        const Vector3i b = block_of(v);
        if (b != last_block) {
          last_block = b;
          last = find_or_make(b);
        }
        Voxel& cell = blocks_[last].voxels[inside(v)];
        const Vector3f centre = voxel_ * (v.cast<float>() + Vector3f::Constant(0.5f));
        const float distance = range - (centre - origin).dot(unit);
        cell.distance = (cell.weight * cell.distance + weight * distance) / (cell.weight + weight);
        cell.weight += weight;
      }
    }
  }
}

std::vector<Vector3f> FusionVolume::extract(float min_weight, float cell_size) const {
  struct Crossing {
    std::uint64_t cell;
    Vector3f point;
  };
  std::vector<Crossing> crossings;
  for (const Block& block : blocks_) {
    for (int i = 0; i < kSide * kSide * kSide; ++i) {
      const Voxel& a = block.voxels[static_cast<std::size_t>(i)];
      if (a.weight < min_weight) continue;
      const Vector3i v = 8 * block.coordinate + Vector3i(i & 7, (i >> 3) & 7, i >> 6);
      for (int axis = 0; axis < 3; ++axis) {
        Vector3i next = v;
        ++next[axis];
        const Voxel* b =
            block_of(next) == block.coordinate ? &block.voxels[inside(next)] : voxel(next);
        if (b == nullptr || b->weight < min_weight || (a.distance > 0) == (b->distance > 0))
          continue;
        // Where the backs of two surfaces meet the sign changes too, but not through small values.
        if (std::abs(a.distance - b->distance) > 2.5f * voxel_) continue;
        Vector3f p = voxel_ * (v.cast<float>() + Vector3f::Constant(0.5f));
        p[axis] += voxel_ * a.distance / (a.distance - b->distance);
        const Vector3i cell = (p / cell_size).array().floor().cast<int>();
        crossings.push_back({pack(cell), p});
      }
    }
  }
  std::stable_sort(crossings.begin(), crossings.end(),
                   [](const Crossing& a, const Crossing& b) { return a.cell < b.cell; });
  std::vector<Vector3f> points;
  for (std::size_t from = 0; from < crossings.size();) {
    std::size_t to = from;
    Vector3f sum = Vector3f::Zero();
    for (; to < crossings.size() && crossings[to].cell == crossings[from].cell; ++to)
      sum += crossings[to].point;
    points.push_back(sum / static_cast<float>(to - from));
    from = to;
  }
  return points;
}

}  // namespace gpureg::synthetic
