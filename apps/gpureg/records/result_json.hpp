// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>
#include <optional>

#include "gpureg/context.hpp"
#include "gpureg/registration/scale.hpp"
#include "gpureg/result.hpp"
#include "json/fields_json.hpp"

namespace gpureg::cli {

/// Numbers row by row.
Json to_json(const Eigen::Ref<const Eigen::MatrixXd>& matrix);

/// status, reason, explanation (of what is not aligned), confidence, inlier_ratio, inlier_rmse, the
/// pose under the given name (null where there is none), statistics, ms.
Json to_json(const RegistrationResult& result, const char* pose_name);

/// The pose under the given name with the scale in it (null where there is none), scale,
/// scale_status, scale_deviation, scale_information (7 x 7), scales, explanation.
Json scale_to_json(const ScaledResult& found, const char* pose_name);

/// Version and backend of the run.
Json environment(const Context& context);

/// Peak resident memory of this process in MiB, as the system counts it.
double peak_memory_mib();

}  // namespace gpureg::cli
