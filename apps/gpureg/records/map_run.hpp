// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <string>

#include "gpureg/reconstruction/reconstruct.hpp"
#include "inputs/scene.hpp"

namespace gpureg::cli {

/// Everything that `gpureg reconstruct` knows at its end, for the files that it writes.
struct MapRun {
  ScanInput input;
  std::string output;
  RegistrationOptions options;
  FragmentFolder scene;  ///< the scans of the map
  reconstruction::MapOfSet made;
  bool aligned_here = false;  ///< the pairs were aligned by this run
  std::size_t map_points = 0;
  double seconds_of_writing = 0;

  std::string file(const std::string& name) const;  ///< path in the output folder
  std::size_t accepted_edges() const;
};

}  // namespace gpureg::cli
