// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <algorithm>
#include <iterator>
#include <memory>
#include <string>
#include <vector>

#include "common/in_halves.hpp"
#include "pipeline/prepared_state.hpp"

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

/// Prepares the clouds of a batch by prepare(begin, end), in halves where they do not fit together.
/// The error of a cloud names it.
template <typename Prepare>
std::vector<std::shared_ptr<PreparedState>> prepare_named(const std::vector<std::string>& names,
                                                          std::size_t clouds,
                                                          const Prepare& prepare) {
  std::vector<std::shared_ptr<PreparedState>> out;
  in_halves(0, clouds, [&](std::size_t begin, std::size_t end) {
    const auto work = [&] { return prepare(begin, end); };
    auto made = end - begin == 1 ? naming_cloud(names, clouds, begin, work) : work();
    std::move(made.begin(), made.end(), std::back_inserter(out));
  });
  return out;
}

}  // namespace gpureg
