// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <vector>

#include "gpureg/preparation/sensor_fixed.hpp"
#include "gpureg/statistics.hpp"
#include "pipeline/kept_rows.hpp"

namespace gpureg {

/// Points at the limits of a sensor's range: `from` and `to` bound the ranges of the others.
struct RangeShells {
  RangeLimits limits;
  double from = 0, to = 0;

  bool exist() const { return limits.points() > 0; }
};

/// @param raw rows in host memory, seen from their first viewpoint or from the origin.
RangeShells range_shells(const RawCloud& raw);

/// A cloud for the engines, without points at the limits of the sensor's range. Only a cloud with
/// such points changes; the others are not copied. It is decided on the host, so that backends
/// agree bit for bit.
class WithoutRangeShells {
 public:
  /// @param raw rows in host memory.
  /// @param keep the cloud stays as it is.
  WithoutRangeShells(const RawCloud& raw, bool keep);

  /// Valid as long as this object and the rows given to it.
  const RawCloud& cloud() const { return kept_.cloud(); }
  /// Corrects the counts of the cloud's preparation.
  void count(PrepareStatistics& statistics) const;

 private:
  KeptRows kept_;
  RangeShells shells_;
};

}  // namespace gpureg
