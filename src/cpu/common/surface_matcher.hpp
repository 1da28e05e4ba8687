// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <memory>
#include <mutex>
#include <vector>

#include "cpu/common/exec.hpp"
#include "pipeline/surface_matcher.hpp"

namespace gpureg::cpu {

/// Search table of one surface.
struct SurfaceGrid {
  SurfaceGridView bounds{};
  std::vector<SurfaceCell> table;
  std::vector<SurfacePoint> points;
  std::vector<SurfaceNormal> normals;

  SurfaceGrid() = default;
  SurfaceGrid(const SurfaceArrays& surface, float distance);
  SurfaceGridView view() const;
};

/// The arrays of the surfaces stay the caller's.
class CpuSurfaces final : public SurfaceMatcher {
 public:
  CpuSurfaces(Exec& exec, std::mutex& mutex, Span<const SurfaceArrays> surfaces)
      : exec_(exec), mutex_(mutex), surfaces_(surfaces.begin(), surfaces.end()) {}

  void add_up(Span<const SurfacePairInput> pairs, const SurfaceTerms& terms,
              Span<SurfaceSums> sums) override;

 private:
  void build_grids(Span<const SurfacePairInput> pairs, float distance);

  Exec& exec_;
  std::mutex& mutex_;
  std::vector<SurfaceArrays> surfaces_;
  std::vector<std::unique_ptr<SurfaceGrid>> grids_;
  float distance_ = 0;  ///< of the grids
};

}  // namespace gpureg::cpu
