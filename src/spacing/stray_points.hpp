// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <vector>

#include "pipeline/kept_rows.hpp"

namespace gpureg {

/// A cloud for the engines, without stray points where these would exhaust the memory: an isolated
/// point fills about five blocks of the closest-point grid. Only a cloud whose blocks exceed
/// limits::kMaxClosestBlocks changes; the others are not copied. It is decided on the host, so that
/// backends agree bit for bit.
class WithoutStrayPoints {
 public:
  /// raw: rows in host memory.
  /// @throws InvalidArgument where nearly all points are stray, or where the others exceed the
  ///   limit, too.
  WithoutStrayPoints(const RawCloud& raw, const PrepareSettings& options);

  /// Valid as long as this object and the rows given to it.
  const RawCloud& cloud() const { return kept_.cloud(); }
  /// Rows that are left, where some were dropped; else empty.
  const std::vector<std::uint32_t>& rows() const { return rows_; }
  /// Corrects the counts of the cloud's preparation.
  void count(PrepareStatistics& statistics) const;

 private:
  KeptRows kept_;
  std::uint64_t input_points_, invalid_points_ = 0, stray_points_ = 0;
  std::vector<std::uint32_t> rows_;
};

}  // namespace gpureg
