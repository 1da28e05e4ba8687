// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "common/validate.hpp"
#include "fields/field.hpp"

namespace gpureg::fields {

/// Throws InvalidArgument naming field and value where one of `object` is out of its range. Groups
/// of fields validate themselves.
template <typename T>
void validate(const T& object) {
  each<T>([&](const std::string& name, auto member, const Field& field) {
    const auto& value = object.*member;
    using M = std::decay_t<decltype(value)>;
    if constexpr (is_described<M>) {
      value.validate();
    } else if constexpr (std::is_enum_v<M>) {
      if (!is_known(value))
        throw_option((Fields<T>::kGroup + name).c_str(), static_cast<int>(value),
                     names_of<M>().c_str());
    } else if constexpr (std::is_arithmetic_v<M>) {
      if (!field.range.contains(static_cast<double>(value)))
        throw_option((Fields<T>::kGroup + name).c_str(), value, expected_of(field.range).c_str());
    }
  });
}

}  // namespace gpureg::fields
