// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>

#include "verbs/map_run.hpp"

namespace gpureg::cli {

/// Takes the pairs of a map from a result of `gpureg batch` or of an earlier map; of the fragments
/// of the folder, it needs the names only.
/// @throws IoError naming the file and the entry: no such result, a damaged one, fragments that the
///   folder lacks, a repeated pair.
/// @throws InvalidArgument where it was made with another voxel size.
void read_pair_results(const std::string& path, MapRun& run);

}  // namespace gpureg::cli
