// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <string>
#include <utility>
#include <vector>

#include "gpureg/registration.hpp"

namespace gpureg::cli {

/// The fragments of a folder, prepared; the raw clouds are let go as soon as they are.
struct Scene {
  std::vector<int> numbers;  ///< as in the file names, ascending
  std::vector<std::string> files;
  std::vector<std::uint64_t>
      hashes;  ///< of what went into prepare(): points, normals, sensor positions
  std::vector<PreparedCloud> clouds;
  double extent = 0;  ///< longest side of the largest fragment
  double seconds = 0;
  bool interrupted = false;  ///< stopped before all were prepared

  /// What Redwood's files give as the number of fragments; larger than the number of files where
  /// numbers are missing.
  int count() const { return numbers.empty() ? 0 : numbers.back() + 1; }
  /// File and number of prepared points of each fragment.
  std::vector<std::pair<std::string, std::size_t>> prepared_sizes() const;
};

/// Reads and prepares all fragments, with their sensor positions from cameras.txt where that is
/// there. Unless quiet, says where that and the fragments do not match. infer_viewpoint: of
/// fragments without a sensor position, see PointCloudView. Throws IoError.
Scene prepare_scene(const Context& context, const std::string& folder,
                    const PrepareOptions& options, bool quiet, bool infer_viewpoint = true);

/// Pairs i < j as indices into numbers, in the file's order without repetitions, or all of them for
/// "all". Unless quiet, says how many are repetitions. Throws IoError for a number that no fragment
/// has.
std::vector<std::pair<std::uint32_t, std::uint32_t>> choose_pairs(const Scene& scene,
                                                                  const std::string& pairs,
                                                                  bool quiet);

}  // namespace gpureg::cli
