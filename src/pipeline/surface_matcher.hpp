// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <vector>

#include "algorithm/surface_sums.hpp"

namespace gpureg {

/// Surfaces in the memory of an engine. Calls run one after another with those of the engine, which
/// has to outlive it.
class SurfaceMatcher {
 public:
  virtual ~SurfaceMatcher() = default;
  /// sums: one per pair. The search tables are kept as long as the distance stays the same.
  virtual void add_up(Span<const SurfacePairInput> pairs, const SurfaceTerms& terms,
                      Span<SurfaceSums> sums) = 0;
};

}  // namespace gpureg
