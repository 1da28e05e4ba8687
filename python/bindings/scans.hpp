// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <string>
#include <vector>

#include "gpureg/io.hpp"

namespace gpureg::python {

/// The scans of a FragmentSet as readers of files take them.
inline std::vector<io::ScanFile> scans_of(const std::vector<int>& numbers,
                                          const std::vector<std::string>& names) {
  std::vector<io::ScanFile> scans;
  for (std::size_t k = 0; k < numbers.size(); ++k) scans.push_back({numbers[k], "", names.at(k)});
  return scans;
}

}  // namespace gpureg::python
