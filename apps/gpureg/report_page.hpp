// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "result_file.hpp"

namespace gpureg::cli {

struct Picture {
  std::string heading, remark;
  std::string png;
};

/// One HTML page without anything from outside: numbers, plots and pictures of a batch.
std::string report_page(const ResultFile& result,
                        const std::optional<evaluation::GroundTruth>& truth,
                        const std::vector<Picture>& pictures);

}  // namespace gpureg::cli
