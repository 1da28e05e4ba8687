// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <memory>
#include <utility>
#include <vector>

#include "gpureg/context.hpp"
#include "gpureg/prepared_cloud.hpp"
#include "pipeline/engine.hpp"

namespace gpureg {

/// Access of the library to the private parts of public handles.
struct Access {
  /// A context of any engine; tests give their own.
  static Context context(std::shared_ptr<Engine> engine) { return Context(std::move(engine)); }
  static const std::shared_ptr<Engine>& engine(const Context& context) { return context.engine_; }
  static const std::shared_ptr<const PreparedState>& state(const PreparedCloud& cloud) {
    return cloud.state_;
  }
  static PreparedCloud cloud(std::shared_ptr<const PreparedState> state) {
    return PreparedCloud(std::move(state));
  }
  static std::vector<PreparedCloud> clouds(std::vector<std::shared_ptr<PreparedState>>&& states) {
    std::vector<PreparedCloud> out;
    for (auto& state : states) out.push_back(cloud(std::move(state)));
    return out;
  }
};

}  // namespace gpureg
