// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>
#include <vector>

#include "gpureg/error.hpp"

namespace gpureg {

/// Throws InvalidArgument unless there is a name for every cloud, or none at all.
inline void check_names(const std::vector<std::string>& names, std::size_t clouds) {
  if (!names.empty() && names.size() != clouds)
    throw InvalidArgument("names has " + std::to_string(names.size()) +
                          " entries, but clouds has " + std::to_string(clouds));
}

/// Calls action(), which works on cloud k of a batch, and adds the name of the cloud to its
/// InvalidArgument. A single cloud without a name needs none.
template <typename Action>
auto naming_cloud(const std::vector<std::string>& names, std::size_t clouds, std::size_t k,
                  const Action& action) {
  try {
    return action();
  } catch (const InvalidArgument& error) {
    if (names.empty() && clouds == 1) throw;
    throw InvalidArgument((names.empty() ? "clouds[" + std::to_string(k) + "]" : names[k]) + ": " +
                          error.what());
  }
}

}  // namespace gpureg
