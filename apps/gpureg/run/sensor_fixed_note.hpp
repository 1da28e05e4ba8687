// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>

#include "gpureg/sets/fragment_set.hpp"

namespace gpureg::cli {

/// "1,204 points at the largest range of 30"; empty without such points. A range of 0: none there.
std::string at_range_limits(std::uint64_t points, double smallest, double largest);

/// Says what was left out of a set of scans as fixed to the sensor.
class SensorFixedNote {
 public:
  void see(const PreparedFragment& fragment, const std::string& file);
  /// One line of each kind on stderr; nothing where nothing was left out.
  void print() const;

 private:
  struct Most {
    std::size_t clouds = 0;
    double share = 0;
    std::string text, file;
    void see(std::uint64_t points, std::uint64_t of, const std::string& what,
             const std::string& of_file);
    std::string line() const;
  };
  Most in_parts_, at_limits_;
};

}  // namespace gpureg::cli
