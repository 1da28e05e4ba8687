// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <vector>

#include "cuda/common/surface_grids.hpp"
#include "cuda/device/lanes.hpp"
#include "pipeline/surface_matcher.hpp"

namespace gpureg::cuda {

/// Surfaces on one device. Search tables of so many that their memory stays bounded exist at a
/// time.
class CudaSurfaces final : public SurfaceMatcher {
 public:
  /// Uploads the surfaces. The lanes must outlive them.
  CudaSurfaces(Lanes& lanes, Span<const SurfaceArrays> surfaces);

  void add_up(Span<const SurfacePairInput> pairs, const SurfaceTerms& terms,
              Span<SurfaceSums> sums) override;

 private:
  /// Consecutive surfaces, [begin, end).
  struct Run {
    std::uint32_t begin, end;
  };
  void make_runs();
  void bring_grids(Exec& exec, const Run& run, float distance);

  static constexpr std::size_t kLane = 0;
  Lanes& lanes_;
  std::vector<SurfaceArrays> surfaces_;  ///< arrays on the device
  std::vector<Run> runs_;
  DeviceBuffer<float> rows_;
  DeviceBuffer<SurfaceArrays> on_device_;
  SurfaceGrids grids_;
  std::uint32_t first_in_grids_ = ~0u;
  float distance_ = 0;  ///< of the grids
};

}  // namespace gpureg::cuda
