// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>

#include "gpureg/options.hpp"

namespace gpureg::cli {

/// Sets the option that "prepare.depth_maps=4" names. Its range is left to validate().
/// @throws InvalidArgument naming what is unknown, or what does not fit.
void set_option(RegistrationOptions& options, const std::string& assignment);

}  // namespace gpureg::cli
