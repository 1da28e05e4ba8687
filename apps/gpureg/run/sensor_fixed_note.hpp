// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "gpureg/preparation/sensor_fixed.hpp"
#include "gpureg/statistics.hpp"

namespace gpureg::cli {

/// "1,204 points at the largest range of 30"; empty without such points. A range of 0: none there.
std::string at_range_limits(std::uint64_t points, double smallest, double largest);

/// Leaves out what is fixed to the sensor in a set of scans, and says so.
class SensorFixedNote {
 public:
  /// Finds the parts in the first clouds, and removes them from these and all later ones.
  void leave_out_parts(std::vector<PointCloud>& clouds, const std::vector<std::string>& files,
                       bool infer_viewpoint);
  /// What the preparation of a cloud left out.
  void see(const PrepareStatistics& statistics, const std::string& file);
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
  std::optional<FixedParts> parts_;
  Most in_parts_, at_limits_;
};

}  // namespace gpureg::cli
