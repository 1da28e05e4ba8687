// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <iterator>
#include <string>
#include <type_traits>

#include "fields/range.hpp"

/// One description per struct of its fields: name, range, one sentence.
/// Validation, JSON, the Python classes, tables of the documentation, the fuzzer and the
/// comparison of results come from it. A new field of a struct is one new line of its Fields.
namespace gpureg::fields {

struct Field {
  constexpr Field(const char* n, const char* s = "") : name(n), sentence(s) {}
  constexpr Field(const char* n, const Range& r, const char* s = "")
      : name(n), range(r), sentence(s) {}

  const char* name;
  Range range = kAnything;
  const char* sentence;
};

/// Specialised for each struct T that is described:
///   kName      name of the class
///   kGroup     what stands before its fields in messages: "prepare."
///   kSentence  what it is
///   visit(v)   calls v(&T::member, field) for each field, and for two that differ in the prefixes
///              source_ and target_ only v(&T::source_x, &T::target_x, field of x)
template <typename T>
struct Fields;

/// Specialised for each enumeration: kAll, its values. Their names are those of to_string().
template <typename E>
struct Values;

template <typename T, typename = void>
constexpr bool is_described = false;
template <typename T>
constexpr bool is_described<T, std::void_t<decltype(Fields<T>::kName)>> = true;

/// Sentence of the second of two sides.
constexpr const char* kOtherSide = "The other way round.";

namespace detail {
/// Resolves the fields of two sides into one each.
template <typename Function>
struct Single {
  Function& function;

  template <typename M, typename T>
  void operator()(M T::* member, const Field& field) {
    function(std::string(field.name), member, field);
  }
  template <typename M, typename T>
  void operator()(M T::* source, M T::* target, const Field& field) {
    function("source_" + std::string(field.name), source, field);
    Field other = field;
    other.sentence = kOtherSide;
    function("target_" + std::string(field.name), target, other);
  }
};
}  // namespace detail

/// Calls function(name, member, field) for each field of T.
template <typename T, typename Function>
void each(Function&& function) {
  Fields<T>::visit(detail::Single<std::remove_reference_t<Function>>{function});
}

/// The value of that name. Values::kAll has it; otherwise none.
template <typename E>
const E* value_named(const std::string& name) {
  for (const E& value : Values<E>::kAll)
    if (name == to_string(value)) return &value;
  return nullptr;
}

template <typename E>
constexpr bool is_known(E value) {
  for (const E known : Values<E>::kAll)
    if (known == value) return true;
  return false;
}

/// a, b or c; each between two `quote`.
template <typename E>
std::string names_of(const char* quote = "") {
  std::string text;
  constexpr std::size_t size = std::size(Values<E>::kAll);
  for (std::size_t k = 0; k < size; ++k)
    text += (k == 0          ? ""
             : k + 1 == size ? " or "
                             : ", ") +
            std::string(quote) + to_string(Values<E>::kAll[k]) + quote;
  return text;
}

}  // namespace gpureg::fields
