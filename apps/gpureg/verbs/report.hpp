// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>

namespace gpureg::cli {

/// Writes the page of one RESULT.json without ground truth.
/// @param clouds folder with the clouds, for pictures; "-": none.
/// @throws IoError.
void write_report(const std::string& result, const std::string& clouds, const std::string& page);

}  // namespace gpureg::cli
