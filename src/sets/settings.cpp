// SPDX-License-Identifier: BSD-3-Clause
#include <charconv>

#include "fields/options.hpp"
#include "gpureg/sets/pair_journal.hpp"

namespace gpureg {
namespace {

using Settings = std::vector<std::pair<std::string, std::string>>;

template <typename Number>
std::string shortest(Number value) {
  char text[64];
  return {text, std::to_chars(text, text + sizeof text, value).ptr};
}

template <typename T>
void add(Settings& out, const std::string& group, const T& object) {
  fields::each<T>([&](const std::string& name, auto member, const fields::Field&) {
    const auto& value = object.*member;
    using M = std::decay_t<decltype(value)>;
    if constexpr (fields::is_described<M>)
      add(out, group + name + ".", value);
    else if constexpr (std::is_enum_v<M>)
      out.emplace_back(group + name, to_string(value));
    else if constexpr (std::is_same_v<M, bool>)
      out.emplace_back(group + name, value ? "true" : "false");
    else if constexpr (std::is_same_v<M, std::string>)
      out.emplace_back(group + name, value);
    else
      out.emplace_back(group + name, shortest(value));
  });
}

}  // namespace

Settings RunIdentity::settings_of(const RegistrationOptions& options,
                                  const std::optional<GravityPrior>& gravity) {
  Settings out{{"version", GPUREG_VERSION}};
  add(out, "options.", options);
  std::string up = "none";
  if (gravity) {
    up.clear();
    for (const Eigen::Vector3d& axis : {gravity->source_up, gravity->target_up})
      for (const double value : axis) up += shortest(value) + " ";
    up += shortest(gravity->max_angle);
  }
  out.emplace_back("up", up);
  return out;
}

}  // namespace gpureg
