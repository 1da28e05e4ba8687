// SPDX-License-Identifier: BSD-3-Clause
#include "algorithm/surface_sides.hpp"

#include <algorithm>

#include "cuda/common/stages.hpp"
#include "cuda/device/launch.cuh"

namespace gpureg::cuda {
namespace {

struct SurfaceSideBatch {
  const std::uint32_t* offset;  // of the clouds' points
  const Vec3 *points, *normals;
  const SurfaceSideGrid* boxes;
  const std::size_t* word_offset;
  std::uint32_t* words;
};

__global__ void mark_surfaces(SurfaceSideBatch f) {
  const std::uint32_t c = blockIdx.y, begin = f.offset[c], size = f.offset[c + 1] - begin;
  const SurfaceSideGrid box = f.boxes[c];
  if (box.words_x == 0) return;
  std::uint32_t* words = f.words + f.word_offset[c];
  for (std::uint32_t i = blockIdx.x * blockDim.x + threadIdx.x; i < size;
       i += gridDim.x * blockDim.x) {
    const SurfaceSideCell cell = surface_side_cell(box, f.points[begin + i]);
    if (cell.word != kNoValue) atomicOr(words + cell.word, kOnSurface << cell.shift);
  }
}

/// A thread per point and side.
__global__ void march(SurfaceSideBatch f) {
  const std::uint32_t c = blockIdx.y, begin = f.offset[c], size = f.offset[c + 1] - begin;
  const SurfaceSideGrid box = f.boxes[c];
  if (box.words_x == 0) return;
  std::uint32_t* words = f.words + f.word_offset[c];
  for (std::uint32_t k = blockIdx.x * blockDim.x + threadIdx.x; k < 2 * size;
       k += gridDim.x * blockDim.x)
    march_surface_side(box, words, f.points[begin + k / 2], f.normals[begin + k / 2], k % 2,
                       [&](std::uint32_t word, std::uint32_t bits) {
                         // Bits already set come from other threads of this step; bits are only
                         // ever added.
                         if ((words[word] & bits) != bits) atomicOr(words + word, bits);
                       });
}

}  // namespace

SurfaceSides build_surface_sides(Exec& exec, const DownsampledClouds& clouds,
                                 const DeviceBuffer<Vec3>& normals,
                                 const PrepareSettings& options) {
  SurfaceSides out;
  out.offset.push_back(0);
  const std::size_t entries = clouds.segments.entries();
  for (std::size_t c = 0; c < entries; ++c) {
    out.boxes.push_back(surface_side_grid(clouds.facts[c].lo, clouds.facts[c].hi,
                                          options.surface_side_distance,
                                          clouds.segments.size(c) > 0));
    out.offset.push_back(out.offset.back() + out.boxes.back().words());
  }
  if (out.offset.back() == 0) return out;
  out.words = exec.filled<std::uint32_t>(out.offset.back(), 0);
  const auto boxes = exec.upload(out.boxes);
  const auto offset = exec.upload(out.offset);
  const SurfaceSideBatch batch{clouds.segments.on_device.data(),
                               clouds.points.data(),
                               normals.data(),
                               boxes.data(),
                               offset.data(),
                               out.words.data()};
  const auto grid = [&](std::size_t items) {
    return dim3(std::max(1u, std::min(blocks_for(items, 256), 64u)),
                static_cast<unsigned>(entries));
  };
  launch(exec, "mark_surfaces", mark_surfaces, {grid(clouds.segments.largest), 256}, batch);
  launch(exec, "march", march, {grid(2 * std::size_t(clouds.segments.largest)), 256}, batch);
  return out;
}

}  // namespace gpureg::cuda
