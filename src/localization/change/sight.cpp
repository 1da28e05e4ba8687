// SPDX-License-Identifier: BSD-3-Clause
#include "localization/change/sight.hpp"

#include <algorithm>
#include <atomic>
#include <cmath>

#include "common/host_threads.hpp"
#include "common/stop_scope.hpp"

namespace gpureg::localization {
namespace {

constexpr int kLevels = 5, kCoarsestEdge = 48;
constexpr std::uint32_t kNoDisc = 0xffffffffu;
/// A disc covers the gaps to its neighbours, those along the diagonal of a voxel too.
constexpr float kDiscRadius = 0.75f;
/// Nearer to the sensor than so many distances of points, a disc would hide everything.
constexpr float kNearest = 4;
/// Flatter than this, a line of sight says little about the plane that it hits.
constexpr float kLeastIncidence = 0.05f;
/// So many cells beside the one of a location may disagree with it, as at the edge of a surface.
constexpr int kOfOthers = 2;

}  // namespace

void Sight::add(const Sight& other) {
  gap = std::max(gap, other.gap);
  free = static_cast<std::uint16_t>(free + other.free);
  surface = static_cast<std::uint16_t>(surface + other.surface);
  blocked = static_cast<std::uint16_t>(blocked + other.blocked);
}

DepthPyramid::DepthPyramid() {
  for (int k = 0; k < kLevels; ++k) {
    const int edge = kCoarsestEdge << k;
    const std::size_t cells = 6 * static_cast<std::size_t>(edge) * static_cast<std::size_t>(edge);
    levels_.push_back({edge, std::vector<float>(cells), std::vector<std::uint32_t>(cells)});
  }
}

void DepthPyramid::splat(Level& level, std::uint32_t disc, float range) {
  const CubeRay ray = cube_ray(surface_->points[disc] - viewpoint_);
  const float half = kDiscRadius * surface_->spacing / ray.depth;
  const int left = cube_row(ray.u - half, level.edge), right = cube_row(ray.u + half, level.edge),
            low = cube_row(ray.v - half, level.edge), high = cube_row(ray.v + half, level.edge);
  for (int v = low; v <= high; ++v) {
    const std::size_t row =
        static_cast<std::size_t>(ray.face * level.edge + v) * static_cast<std::size_t>(level.edge);
    for (int u = left; u <= right; ++u) {
      const std::size_t cell = row + static_cast<std::size_t>(u);
      if (range >= level.range[cell]) continue;
      level.range[cell] = range;
      level.disc[cell] = disc;
    }
  }
}

void DepthPyramid::render(const Surface& surface, std::size_t number) {
  const Eigen::Vector3f& viewpoint = surface.viewpoints[number];
  surface_ = &surface;
  viewpoint_ = viewpoint;
  horizon_ = surface.horizons.empty() ? nullptr : &surface.horizons[number];
  for (Level& level : levels_) {
    std::fill(level.range.begin(), level.range.end(), INFINITY);
    std::fill(level.disc.begin(), level.disc.end(), kNoDisc);
  }
  const float nearest = kNearest * surface.spacing;
  for (std::uint32_t k = 0; k < surface.points.size(); ++k) {
    const float range = (surface.points[k] - viewpoint).norm();
    if (!(range > nearest)) continue;
    for (Level& level : levels_) splat(level, k, range);
  }
}

Sight DepthPyramid::at(const Eigen::Vector3f& p, float tolerance) const {
  const Eigen::Vector3f d = p - viewpoint_;
  const float range = d.norm();
  if (!(range > kNearest * surface_->spacing)) return {};
  // Cells no wider than the distance of points at the location.
  const float wanted = 2 * range / surface_->spacing;
  std::size_t k = 0;
  while (k + 1 < levels_.size() && static_cast<float>(levels_[k].edge) < wanted) ++k;
  const Level& level = levels_[k];
  const CubeRay ray = cube_ray(d);
  const int column = cube_row(ray.u, level.edge), row = cube_row(ray.v, level.edge);
  Sight sight;
  int on = 0, blocked = 0;
  bool free = false;
  float gap = INFINITY;
  for (int v = std::max(row - 1, 0); v <= std::min(row + 1, level.edge - 1); ++v)
    for (int u = std::max(column - 1, 0); u <= std::min(column + 1, level.edge - 1); ++u) {
      const std::size_t cell = static_cast<std::size_t>(ray.face * level.edge + v) *
                                   static_cast<std::size_t>(level.edge) +
                               static_cast<std::size_t>(u);
      const std::uint32_t disc = level.disc[cell];
      if (disc == kNoDisc) continue;
      const Eigen::Vector3f s = surface_->points[disc] - viewpoint_;
      Eigen::Vector3f normal = surface_->normals[disc];
      const float incidence = -normal.dot(s) / level.range[cell];
      if (std::abs(incidence) < kLeastIncidence) normal = -s / level.range[cell];
      if (incidence < 0) normal = -normal;
      const float before = normal.dot(d - s);
      if (before < -tolerance) {
        blocked += 1 + (u == column && v == row ? kOfOthers : 0);
      } else if (before <= tolerance) {
        on += 1 + (u == column && v == row ? kOfOthers : 0);
      } else if (level.range[cell] > range) {
        free = true;
        gap = std::min(gap, before);
      }
    }
  if (blocked > kOfOthers)
    sight.blocked = 1;
  else if (on > kOfOthers)
    sight.surface = 1;
  else if (free && (horizon_ == nullptr || horizon_->reaches(d, surface_->horizon_step)))
    sight.free = 1, sight.gap = gap;
  return sight;
}

std::vector<Sight> sights(const Surface& surface, const std::vector<Eigen::Vector3f>& locations,
                          const std::vector<float>& tolerances, unsigned threads) {
  const std::size_t workers = std::clamp<std::size_t>(surface.viewpoints.size(), 1, threads);
  std::vector<std::vector<Sight>> parts(workers);
  std::atomic<std::size_t> next{0};
  on_threads(workers, [&](std::size_t worker) {
    DepthPyramid pyramid;
    std::vector<Sight>& mine = parts[worker];
    mine.resize(locations.size());
    for (std::size_t v; (v = next.fetch_add(1)) < surface.viewpoints.size();) {
      StopScope::poll();
      pyramid.render(surface, v);
      for (std::size_t k = 0; k < locations.size(); ++k)
        if (tolerances[k] > 0) mine[k].add(pyramid.at(locations[k], tolerances[k]));
    }
  });
  for (std::size_t worker = 1; worker < workers; ++worker)
    for (std::size_t k = 0; k < locations.size(); ++k) parts[0][k].add(parts[worker][k]);
  return std::move(parts[0]);
}

}  // namespace gpureg::localization
