// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>
#include <string_view>

#include "gpureg/result.hpp"

namespace gpureg::sets {

/// A result without loss, timings too.
std::string bytes_of(const RegistrationResult& result);

/// @param path of the file that the bytes are from.
/// @throws IoError where they are none of a result.
RegistrationResult result_of(std::string_view bytes, const std::string& path);

}  // namespace gpureg::sets
