// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <optional>
#include <string>
#include <utility>
#include <vector>

namespace gpureg::cli {

/// Replaces the characters that HTML and SVG reserve.
std::string escaped(const std::string& text);

struct Curve {
  std::string name, color;
  std::vector<std::pair<double, double>> points;  ///< both in [0, 1]
  std::pair<double, double> operating_point;      ///< drawn as a dot
};

/// Inline SVG: both axes from 0 to 100 %.
std::string curve_plot(const std::vector<Curve>& curves, const std::string& x_title,
                       const std::string& y_title);

struct Population {
  std::string name, color;
  std::vector<double> values;
};

/// Inline SVG: stacked histograms of values in [0, 1]; other values count in the first or last bin.
/// threshold: drawn as a vertical line.
std::string histogram_plot(const std::vector<Population>& populations, const std::string& x_title,
                           const std::optional<double>& threshold);

struct Bar {
  std::string name, color;
  double value = 0;
};

/// Inline SVG: horizontal bars with their values.
std::string bar_plot(const std::vector<Bar>& bars, const std::string& unit);

}  // namespace gpureg::cli
