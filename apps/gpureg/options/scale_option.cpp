// SPDX-License-Identifier: BSD-3-Clause
#include "options/scale_option.hpp"

#include <cmath>

#include "gpureg/error.hpp"

namespace gpureg::cli {

void ScaleChoice::add_to(Verb& verb) {
  verb.option("--scale", text,
              "Lengths of the target's unit per unit of the source (without: 1). free: searched; "
              "0.5:2: searched in that range; poses then contain the scale")
      .type_name("free, MIN:MAX or VALUE");
}

ScaleRange ScaleChoice::range() const {
  if (text.empty()) return ScaleRange::known(1);
  if (text == "free") return ScaleRange::free();
  const auto refuse = [&](const std::string& why) {
    throw InvalidArgument("--scale is " + text + ", expected " + why);
  };
  const auto number = [&](const std::string& word) {
    double value = 0;
    if (!read_number(word, value)) refuse("free, MIN:MAX or a number > 0");
    if (!(std::isfinite(value) && value > 0)) refuse("numbers > 0");
    return value;
  };
  const std::size_t colon = text.find(':');
  if (colon == std::string::npos) return ScaleRange::known(number(text));
  const ScaleRange range{number(text.substr(0, colon)), number(text.substr(colon + 1))};
  if (range.least > range.most) refuse("the smaller end first");
  return range;
}

void scale_cloud(PointCloud& cloud, double scale) {
  const auto scaled = [scale](Eigen::Vector3f& p) { p = (p.cast<double>() * scale).cast<float>(); };
  for (Eigen::Vector3f& p : cloud.points) scaled(p);
  for (Eigen::Vector3f& p : cloud.viewpoints) scaled(p);
  cloud.origin *= scale;
}

}  // namespace gpureg::cli
