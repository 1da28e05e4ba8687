// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cerrno>
#include <cstdint>
#include <cstdlib>
#include <functional>
#include <limits>
#include <string>
#include <type_traits>
#include <vector>

#include "fields/field.hpp"
#include "gpureg/error.hpp"

/// Assignments as text: "evidence.sample=1024".
namespace gpureg::fields {

/// The name that was meant, of those that there are; empty: none is near.
using Guess =
    std::function<std::string(const std::string& name, const std::vector<std::string>& all)>;

namespace detail {
struct Assignment {
  std::string whole, rest, value;  ///< rest: of the name, on the way to its group

  [[noreturn]] void refuse(const std::string& why) const {
    throw InvalidArgument(whole + ": " + why);
  }
  std::string take_name() {
    const std::size_t dot = rest.find('.');
    const std::string name = rest.substr(0, dot);
    rest = dot == std::string::npos ? "" : rest.substr(dot + 1);
    return name;
  }
};

inline void parse(const Assignment& a, bool& out) {
  if (a.value != "true" && a.value != "false") a.refuse("expected true or false");
  out = a.value == "true";
}

inline void parse(const Assignment& a, std::string& out) { out = a.value; }

template <typename M>
void parse(const Assignment& a, M& out) {
  if constexpr (std::is_enum_v<M>) {
    const M* named = value_named<M>(a.value);
    if (!named) a.refuse("expected " + names_of<M>());
    out = *named;
  } else if constexpr (std::is_floating_point_v<M>) {
    char* end = nullptr;
    out = static_cast<M>(std::strtod(a.value.c_str(), &end));
    if (a.value.empty() || *end != 0) a.refuse("expected a number");
  } else {
    const bool digits =
        !a.value.empty() && a.value.find_first_not_of("0123456789") == std::string::npos;
    errno = 0;
    const unsigned long long number = digits ? std::strtoull(a.value.c_str(), nullptr, 10) : 0;
    if (!digits || errno != 0 || number > std::numeric_limits<M>::max())
      a.refuse("expected a whole number from 0 to " +
               std::to_string(std::numeric_limits<M>::max()));
    out = static_cast<M>(number);
  }
}

template <typename T>
void assign(T& object, Assignment& a, const Guess& guess) {
  const std::string name = a.take_name();
  bool known = false;
  std::vector<std::string> names;
  each<T>([&](const std::string& field, auto member, const Field&) {
    using M = std::decay_t<decltype(object.*member)>;
    names.push_back(field);
    if (field != name || known) return;
    if constexpr (is_described<M>) {
      known = true;
      assign(object.*member, a, guess);
    } else if (a.rest.empty()) {
      known = true;
      parse(a, object.*member);
    }
  });
  if (known) return;
  std::string list;
  for (const std::string& field : names) list += (list.empty() ? "" : ", ") + field;
  const std::string meant = guess ? guess(name, names) : "";
  a.refuse("there is no such option" + (meant.empty() ? "" : " (did you mean " + meant + "?)") +
           ", only " + list);
}
}  // namespace detail

/// Sets the field that "group.name=value" names. Its range is left to validate().
/// @throws InvalidArgument naming what is unknown, or what does not fit.
template <typename T>
void assign(T& object, const std::string& assignment, const Guess& guess = {}) {
  const std::size_t equals = assignment.find('=');
  detail::Assignment a{assignment, assignment.substr(0, equals), ""};
  if (equals == std::string::npos) a.refuse("expected NAME=VALUE");
  a.value = assignment.substr(equals + 1);
  detail::assign(object, a, guess);
}

}  // namespace gpureg::fields
