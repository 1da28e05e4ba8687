// SPDX-License-Identifier: BSD-3-Clause
#include "run/sensor_fixed_note.hpp"

#include <iostream>

#include "text.hpp"

namespace gpureg::cli {
std::string at_range_limits(std::uint64_t points, double smallest, double largest) {
  if (points == 0) return "";
  std::string where;
  if (smallest > 0) where = "the smallest range of " + significant(smallest, 4);
  if (largest > 0)
    where +=
        (where.empty() ? "the " : " and the ") + ("largest range of " + significant(largest, 4));
  return grouped(points) + " points at " + (where.empty() ? "the sensor itself" : where);
}

void SensorFixedNote::Most::see(std::uint64_t points, std::uint64_t of, const std::string& what,
                                const std::string& of_file) {
  if (points == 0) return;
  ++clouds;
  const double its_share = static_cast<double>(points) / static_cast<double>(of);
  if (its_share <= share) return;
  share = its_share;
  text = what;
  file = of_file;
}

std::string SensorFixedNote::Most::line() const {
  return text + " (" + percent(share) + " % of " + file +
         (clouds > 2   ? ", and some of " + std::to_string(clouds - 1) + " more scans"
          : clouds > 1 ? ", and some of another scan"
                       : "") +
         ")";
}

void SensorFixedNote::see(const PreparedFragment& fragment, const std::string& file) {
  const PrepareStatistics& s = fragment.cloud.statistics();
  in_parts_.see(fragment.fixed_points, s.input_points + fragment.fixed_points,
                grouped(fragment.fixed_points) + " points", file);
  at_limits_.see(s.range_limit_points, s.input_points,
                 at_range_limits(s.range_limit_points, s.smallest_range, s.largest_range), file);
}

void SensorFixedNote::print() const {
  if (in_parts_.clouds > 0)
    std::cerr << "gpureg: note: left out as fixed to the sensor (vehicle, tripod, hand), because "
                 "most scans have them at the same place: "
              << in_parts_.line() << std::endl;
  if (at_limits_.clouds > 0)
    std::cerr << "gpureg: note: left out, as rays without a return: " << at_limits_.line()
              << "; --set prepare.keep_range_limits=true keeps them" << std::endl;
}

}  // namespace gpureg::cli
