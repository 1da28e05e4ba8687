// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <vector>

#include "gpureg/evaluation/trajectory.hpp"

namespace gpureg::evaluation {

ErrorStatistics statistics_of(std::vector<double> errors);

}  // namespace gpureg::evaluation
