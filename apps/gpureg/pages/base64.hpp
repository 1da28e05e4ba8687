// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>

namespace gpureg::cli {

/// RFC 4648, with padding.
std::string base64(const std::string& bytes);

}  // namespace gpureg::cli
