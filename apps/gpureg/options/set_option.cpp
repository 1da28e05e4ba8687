// SPDX-License-Identifier: BSD-3-Clause
#include "options/set_option.hpp"

#include "fields/assign.hpp"
#include "fields/options.hpp"
#include "text.hpp"

namespace gpureg::cli {

void set_option(RegistrationOptions& options, const std::string& assignment) {
  try {
    fields::assign(options, assignment, nearest);
  } catch (const InvalidArgument& error) {
    throw InvalidArgument("--set " + std::string(error.what()));
  }
}

}  // namespace gpureg::cli
