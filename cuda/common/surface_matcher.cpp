// SPDX-License-Identifier: BSD-3-Clause
#include "cuda/common/surface_matcher.hpp"

#include <algorithm>

namespace gpureg::cuda {
namespace {

/// Points and surfaces whose search tables exist together. A point takes 32 bytes, and as much
/// again while the tables are built; a cell takes up to 96.
constexpr std::uint64_t kPointsPerRun = std::uint64_t(1) << 24;
constexpr std::uint32_t kSurfacesPerRun = 4096;

}  // namespace

CudaSurfaces::CudaSurfaces(Lanes& lanes, Span<const SurfaceArrays> surfaces)
    : lanes_(lanes), surfaces_(surfaces.begin(), surfaces.end()) {
  const Lanes::Held held = lanes_.one(kLane);
  Exec& exec = held.exec();
  const DeviceScope scope(exec.device());
  exec.begin();
  std::size_t total = 0;
  for (const SurfaceArrays& surface : surfaces_) total += surface.size;
  rows_ = exec.buffer<float>(7 * total);
  std::vector<RowsToUpload> parts;
  float* next = rows_.data();
  const auto move = [&](const float*& rows, std::size_t count, std::size_t width) {
    if (count > 0) parts.push_back({rows, count, width, width, next});
    rows = next;
    next += count * width;
  };
  for (SurfaceArrays& surface : surfaces_) {
    move(surface.points, surface.size, 3);
    move(surface.normals, surface.size, 3);
    move(surface.variances, surface.size, 1);
  }
  exec.uploader().upload(span_of(parts), exec.device(), exec.stream());
  on_device_ = exec.upload(surfaces_);
  exec.synchronize();
  make_runs();
}

void CudaSurfaces::make_runs() {
  std::uint64_t points = 0;
  for (std::uint32_t s = 0; s < surfaces_.size(); ++s) {
    if (runs_.empty() || points + surfaces_[s].size > kPointsPerRun ||
        s - runs_.back().begin == kSurfacesPerRun) {
      runs_.push_back({s, s});
      points = 0;
    }
    points += surfaces_[s].size;
    runs_.back().end = s + 1;
  }
}

void CudaSurfaces::bring_grids(Exec& exec, const Run& run, float distance) {
  if (first_in_grids_ == run.begin && distance_ == distance) return;
  first_in_grids_ = ~0u;
  grids_ = {};
  grids_ = build_surface_grids(exec, {surfaces_.data() + run.begin, run.end - run.begin},
                               on_device_.data() + run.begin, distance);
  first_in_grids_ = run.begin;
  distance_ = distance;
}

void CudaSurfaces::add_up(Span<const SurfacePairInput> pairs, const SurfaceTerms& terms,
                          Span<SurfaceSums> sums) {
  const Lanes::Held held = lanes_.one(kLane);
  Exec& exec = held.exec();
  const DeviceScope scope(exec.device());
  std::fill(sums.begin(), sums.end(), SurfaceSums{});
  for (const Run& run : runs_) {
    std::vector<std::size_t> place;
    std::vector<SurfacePairInput> some;
    std::uint32_t most_points = 0;
    for (std::size_t p = 0; p < pairs.size; ++p) {
      const SurfacePairInput& pair = pairs[p];
      if (pair.target < run.begin || pair.target >= run.end || surfaces_[pair.target].usable == 0 ||
          surfaces_[pair.source].usable == 0)
        continue;
      place.push_back(p);
      some.push_back(pair);
      most_points = std::max(most_points, surfaces_[pair.source].size);
    }
    if (some.empty()) continue;
    exec.begin();
    bring_grids(exec, run, terms.max_distance);
    const auto on_device = exec.upload(some);
    const auto results = exec.filled<SurfaceSums>(some.size(), 0);
    add_up_surfaces(exec, on_device_.data(), grids_, run.begin, on_device.data(), some.size(),
                    most_points, terms, results.data());
    const SurfaceSums* added = exec.download(results.data(), some.size());
    exec.synchronize();
    for (std::size_t k = 0; k < place.size(); ++k) sums[place[k]] = added[k];
  }
}

}  // namespace gpureg::cuda
