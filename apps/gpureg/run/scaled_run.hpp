// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>
#include <vector>

#include "gpureg/context.hpp"
#include "gpureg/registration/scale.hpp"
#include "inputs/scene.hpp"
#include "json/json_fwd.hpp"
#include "options/method_options.hpp"

namespace gpureg::cli {

/// The pairs of a folder whose scans have scales of their own.
struct ScaledRun {
  FragmentFolder folder;
  std::vector<Pair> pairs;  ///< i is the target, j the source
  std::vector<ScaledResult> results;
  std::vector<float> voxel_sizes;  ///< of each pair, in the unit of its target
  double seconds = 0;
  bool interrupted = false;
};

/// Reads the scans and finds scale and pose of the pairs. An automatic voxel size is that of each
/// target. infer_viewpoint: see PointCloudView. Throws IoError, InvalidArgument.
ScaledRun run_scaled(const Context& context, const ScanInput& input, const std::string& pairs,
                     const ScaleRange& range, MethodOptions method, bool infer_viewpoint,
                     bool quiet);

/// Redwood's log of the aligned pairs: T_ij with the scale in it.
void write_scaled_log(const std::string& path, const ScaledRun& run);

/// The pairs of RESULT.json, with scale, scale_status, scale_deviation and voxel_size each.
Json scaled_pairs_json(const ScaledRun& run);

}  // namespace gpureg::cli
