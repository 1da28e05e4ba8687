// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>
#include <vector>

#include "pages/report_page.hpp"

namespace gpureg::cli {

/// The HTML id of the part of the page about entries[index].
std::string result_anchor(std::size_t index);

/// Title, a table with one row per result, and per scene the curves of its results.
std::string comparison(const std::vector<ReportEntry>& entries);

}  // namespace gpureg::cli
