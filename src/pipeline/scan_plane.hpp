// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>

namespace gpureg {

/// The plane of a scan of a 2-D scanner: the rows p with normal * p = offset.
struct ScanPlane {
  double normal[3] = {0, 0, 0};  ///< unit vector, upwards where the plane is not vertical
  double offset = 0;             ///< relative to the caller's rows
  std::uint32_t layers = 0;      ///< copies of the scan in the prepared cloud; 0: no 2-D scan

  bool exists() const { return layers > 0; }
};

}  // namespace gpureg
