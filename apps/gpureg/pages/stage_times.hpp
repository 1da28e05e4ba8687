// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <string>
#include <unordered_map>
#include <vector>

#include "json/json.hpp"
#include "pages/plot.hpp"

namespace gpureg::cli {

/// Times of the stages of many pairs or fragments. Programs have stages of their own.
class StageTimes {
 public:
  /// An object "ms": milliseconds by stage, and their "total", which is no stage.
  void add(const Json& ms);

  /// Mean of each stage over all objects, in the order of their first appearance.
  std::vector<Bar> bars(const char* color) const;

 private:
  struct Stage {
    std::string name;
    std::vector<double> milliseconds;
  };
  std::vector<Stage> stages_;
  std::unordered_map<std::string, std::size_t> places_;  ///< in stages_
  std::size_t objects_ = 0;
};

}  // namespace gpureg::cli
