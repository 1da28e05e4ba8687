// SPDX-License-Identifier: BSD-3-Clause
#include "options/set_option.hpp"

#include <cerrno>
#include <cstdlib>
#include <limits>
#include <vector>

#include "fields/options.hpp"
#include "gpureg/error.hpp"
#include "text.hpp"

namespace gpureg::cli {
namespace {

/// NAME=VALUE, with what is left of NAME on the way to its group.
struct Assignment {
  std::string whole, rest, value;

  [[noreturn]] void refuse(const std::string& why) const {
    throw InvalidArgument("--set " + whole + ": " + why);
  }
  std::string take_name() {
    const std::size_t dot = rest.find('.');
    const std::string name = rest.substr(0, dot);
    rest = dot == std::string::npos ? "" : rest.substr(dot + 1);
    return name;
  }
};

void parse(const Assignment& a, bool& out) {
  if (a.value != "true" && a.value != "false") a.refuse("expected true or false");
  out = a.value == "true";
}

template <typename M>
void parse(const Assignment& a, M& out) {
  if constexpr (std::is_enum_v<M>) {
    const M* named = fields::value_named<M>(a.value);
    if (!named) a.refuse("expected " + fields::names_of<M>());
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
void assign(T& options, Assignment& a) {
  const std::string name = a.take_name();
  bool known = false;
  std::vector<std::string> names;
  fields::each<T>([&](const std::string& field, auto member, const fields::Field&) {
    using M = std::decay_t<decltype(options.*member)>;
    names.push_back(field);
    if (field != name || known) return;
    if constexpr (fields::is_described<M>) {
      known = true;
      assign(options.*member, a);
    } else if (a.rest.empty()) {
      known = true;
      parse(a, options.*member);
    }
  });
  if (known) return;
  std::string list;
  for (const std::string& field : names) list += (list.empty() ? "" : ", ") + field;
  const std::string meant = nearest(name, names);
  a.refuse("there is no such option" + (meant.empty() ? "" : " (did you mean " + meant + "?)") +
           ", only " + list);
}

}  // namespace

void set_option(RegistrationOptions& options, const std::string& assignment) {
  const std::size_t equals = assignment.find('=');
  Assignment a{assignment, assignment.substr(0, equals), ""};
  if (equals == std::string::npos) a.refuse("expected NAME=VALUE");
  a.value = assignment.substr(equals + 1);
  assign(options, a);
}

}  // namespace gpureg::cli
