// SPDX-License-Identifier: BSD-3-Clause
#include "pages/stage_times.hpp"

namespace gpureg::cli {

void StageTimes::add(const Json& ms) {
  ++objects_;
  for (const auto& item : ms.items()) {
    if (item.key() == "total" || !item.value().is_number()) continue;
    const auto [place, is_new] = places_.emplace(item.key(), stages_.size());
    if (is_new) stages_.push_back({item.key(), {}});
    stages_[place->second].milliseconds.push_back(item.value().get<double>());
  }
}

std::vector<Bar> StageTimes::bars(const char* color) const {
  std::vector<Bar> bars;
  for (const Stage& stage : stages_) {
    double mean = 0;
    for (const double ms : stage.milliseconds) mean += ms / static_cast<double>(objects_);
    bars.push_back({stage.name, color, mean});
  }
  return bars;
}

}  // namespace gpureg::cli
