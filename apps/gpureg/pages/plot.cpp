// SPDX-License-Identifier: BSD-3-Clause
#include "pages/plot.hpp"

#include <algorithm>
#include <cmath>

#include "text.hpp"

namespace gpureg::cli {
namespace {

// Size of a plot and its margins around the axes, in pixels.
constexpr double kPlotWidth = 460, kPlotHeight = 320, kLeft = 52, kTop = 14, kRight = 14,
                 kBottom = 46;
constexpr double kSpanX = kPlotWidth - kLeft - kRight, kSpanY = kPlotHeight - kTop - kBottom;

std::string n(double value) { return fixed(value, 1); }
double px(double x) { return kLeft + kSpanX * std::clamp(x, 0.0, 1.0); }
double py(double y) { return kTop + kSpanY * (1 - std::clamp(y, 0.0, 1.0)); }

std::string begin(double width, double height) {
  return "<svg viewBox=\"0 0 " + n(width) + " " + n(height) + "\" width=\"" + n(width) +
         "\" height=\"" + n(height) + "\" role=\"img\">\n";
}

std::string line(double x1, double y1, double x2, double y2, const std::string& style) {
  return "<line x1=\"" + n(x1) + "\" y1=\"" + n(y1) + "\" x2=\"" + n(x2) + "\" y2=\"" + n(y2) +
         "\" " + style + "/>\n";
}

std::string rectangle(double x, double y, double width, double height, const std::string& color) {
  return "<rect x=\"" + n(x) + "\" y=\"" + n(y) + "\" width=\"" + n(width) + "\" height=\"" +
         n(height) + "\" fill=\"" + color + "\"/>\n";
}

std::string label(double x, double y, const std::string& anchor, const std::string& text,
                  const std::string& more = "") {
  return "<text x=\"" + n(x) + "\" y=\"" + n(y) + "\" text-anchor=\"" + anchor + "\" " + more +
         ">" + escaped(text) + "</text>\n";
}

constexpr const char* kGrid = "stroke=\"#e4e4de\"";

std::string titles(const std::string& x_title, const std::string& y_title) {
  const double middle = kTop + kSpanY / 2;
  return label(kLeft + kSpanX / 2, kPlotHeight - 8, "middle", x_title) +
         label(14, middle, "middle", y_title, "transform=\"rotate(-90 14 " + n(middle) + ")\"");
}

std::string legend_entry(double x, double y, const std::string& color, const std::string& name) {
  return rectangle(x, y - 9, 11, 11, color) + label(x + 17, y, "start", name);
}

}  // namespace

std::string escaped(const std::string& text) {
  std::string safe;
  for (const char c : text) switch (c) {
      case '&':
        safe += "&amp;";
        break;
      case '<':
        safe += "&lt;";
        break;
      case '>':
        safe += "&gt;";
        break;
      case '"':
        safe += "&quot;";
        break;
      default:
        safe += c;
    }
  return safe;
}

std::string curve_plot(const std::vector<Curve>& curves, const std::string& x_title,
                       const std::string& y_title) {
  std::string svg = begin(kPlotWidth, kPlotHeight);
  for (int tick = 0; tick <= 5; ++tick) {
    const double at = tick / 5.0;
    svg += line(px(at), py(0), px(at), py(1), kGrid) + line(px(0), py(at), px(1), py(at), kGrid);
    svg += label(px(at), py(0) + 17, "middle", std::to_string(20 * tick));
    svg += label(px(0) - 7, py(at) + 4, "end", std::to_string(20 * tick));
  }
  double y = py(0) - 12 - 18 * static_cast<double>(curves.size() - 1);
  for (const Curve& curve : curves) {
    svg += "<polyline fill=\"none\" stroke-width=\"2\" stroke=\"" + curve.color + "\" points=\"";
    for (const auto& [a, b] : curve.points) svg += n(px(a)) + "," + n(py(b)) + " ";
    svg += "\"/>\n<circle r=\"4.5\" cx=\"" + n(px(curve.operating_point.first)) + "\" cy=\"" +
           n(py(curve.operating_point.second)) + "\" fill=\"" + curve.color + "\"/>\n";
    svg += legend_entry(px(0) + 12, y, curve.color, curve.name);
    y += 18;
  }
  return svg + titles(x_title, y_title) + "</svg>\n";
}

std::string histogram_plot(const std::vector<Population>& populations, const std::string& x_title,
                           const std::optional<double>& threshold) {
  constexpr std::size_t kBins = 25;
  std::vector<std::vector<std::size_t>> counts;
  std::vector<std::size_t> sums(kBins, 0);
  for (const Population& population : populations) {
    counts.emplace_back(kBins, 0);
    for (const double value : population.values) {
      const auto bin = static_cast<std::size_t>(std::clamp(value * kBins, 0.0, kBins - 1.0));
      ++counts.back()[bin];
      ++sums[bin];
    }
  }
  const auto most =
      static_cast<double>(std::max<std::size_t>(1, *std::max_element(sums.begin(), sums.end())));
  const double highest = 1.3 * most;  // space for the legend and the threshold's label
  std::string svg = begin(kPlotWidth, kPlotHeight);
  for (int tick = 0; tick <= 5; ++tick)
    svg += label(px(tick / 5.0), py(0) + 17, "middle", fixed(tick / 5.0, 1));
  // About four ticks, at integers: the axis counts pairs.
  const double step = std::max(1.0, std::ceil(most / 4));
  for (double count = 0; count <= most; count += step)
    svg += line(px(0), py(count / highest), px(1), py(count / highest), kGrid) +
           label(px(0) - 7, py(count / highest) + 4, "end", fixed(count, 0));
  for (std::size_t bin = 0; bin < kBins; ++bin) {
    double below = 0;
    for (std::size_t k = 0; k < populations.size(); ++k) {
      const auto count = static_cast<double>(counts[k][bin]);
      if (count > 0)
        svg += rectangle(px(static_cast<double>(bin) / kBins) + 0.5, py((below + count) / highest),
                         kSpanX / kBins - 1, py(below / highest) - py((below + count) / highest),
                         populations[k].color);
      below += count;
    }
  }
  if (threshold) {
    svg += line(px(*threshold), py(0), px(*threshold), py(1),
                "stroke=\"#555\" stroke-dasharray=\"4 3\"");
    svg += label(px(*threshold) + 5, py(1) + 10, "start", "reporting threshold");
  }
  double y = py(1) + 28;
  for (const Population& population : populations) {
    svg += legend_entry(px(1) - 130, y, population.color,
                        population.name + " (" + std::to_string(population.values.size()) + ")");
    y += 18;
  }
  return svg + titles(x_title, "pairs") + "</svg>\n";
}

std::string bar_plot(const std::vector<Bar>& bars, const std::string& unit) {
  constexpr double kRow = 24, kName = 150, kValue = 80;
  constexpr double kLeastShown = 0.01;
  double longest = 1e-12;
  for (const Bar& bar : bars) longest = std::max(longest, bar.value);
  std::string svg = begin(kPlotWidth, kRow * static_cast<double>(bars.size()) + 8);
  double y = 4;
  for (const Bar& bar : bars) {
    const double length = (kPlotWidth - kName - kValue) * std::max(0.0, bar.value) / longest;
    svg += label(kName - 8, y + 16, "end", bar.name) +
           rectangle(kName, y + 3, std::max(length, 1.0), kRow - 6, bar.color) +
           label(kName + length + 6, y + 16, "start",
                 (bar.value < kLeastShown ? "< 0.01" : significant(bar.value, 3)) + " " + unit);
    y += kRow;
  }
  return svg + "</svg>\n";
}

}  // namespace gpureg::cli
