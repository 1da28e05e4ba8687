// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>
#include <optional>

#include "gpureg/context.hpp"
#include "gpureg/result.hpp"
#include "records/json.hpp"

namespace gpureg::cli {

/// Numbers row by row.
Json to_json(const Eigen::Ref<const Eigen::MatrixXd>& matrix);

Json to_json(const RegistrationStatistics& statistics);
Json to_json(const StageTimings& timings);       ///< milliseconds per stage, and their total
Json to_json(const PrepareStatistics& prepare);  ///< counts, and "ms" per stage

/// status, reason, score, inlier_ratio, inlier_rmse, the pose under the given name (null where
/// there is none), statistics, ms.
Json to_json(const RegistrationResult& result, const char* pose_name);

/// Version and backend of the run.
Json environment(const Context& context);

/// Peak resident memory of this process in MiB, as the system counts it.
double peak_memory_mib();

}  // namespace gpureg::cli
