// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <charconv>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <string>
#include <system_error>
#include <type_traits>

/// std::from_chars of double also where the C++ library lacks it: libc++ before LLVM 20. Private to
/// the library.
namespace gpureg::files {

#if defined(__cpp_lib_to_chars) && !defined(GPUREG_OWN_NUMBERS)
using std::from_chars;
#else

/// The decimal point of the current locale, which strtod uses.
inline char decimal_point() {
  char text[8];
  std::snprintf(text, sizeof text, "%.1f", 0.5);
  return text[1];
}

/// Length of the decimal number, infinity or NaN that the text begins with.
inline std::size_t number_length(const char* first, const char* last) {
  const char* c = first;
  const auto digits = [&] {
    const char* const begin = c;
    while (c != last && *c >= '0' && *c <= '9') ++c;
    return c - begin;
  };
  const auto word = [&](const char* lower) {
    const char* at = c;
    for (; *lower != '\0'; ++lower, ++at)
      if (at == last || (*at | 0x20) != *lower) return false;
    c = at;
    return true;
  };
  if (c != last && *c == '-') ++c;
  if (word("infinity") || word("inf") || word("nan")) return static_cast<std::size_t>(c - first);
  std::ptrdiff_t count = digits();
  if (c != last && *c == '.') {
    ++c;
    count += digits();
  }
  if (count == 0) return 0;
  const char* const mantissa = c;
  if (c != last && (*c == 'e' || *c == 'E')) {
    ++c;
    if (c != last && (*c == '-' || *c == '+')) ++c;
    if (digits() == 0) c = mantissa;
  }
  return static_cast<std::size_t>(c - first);
}

inline std::from_chars_result from_chars(const char* first, const char* last, double& value) {
  const std::size_t length = number_length(first, last);
  if (length == 0) return {first, std::errc::invalid_argument};
  std::string text(first, length);
  for (char& c : text)
    if (c == '.') c = decimal_point();
  const double parsed = std::strtod(text.c_str(), nullptr);
  const char* const end = first + length;
  const bool named = text.find_first_of("nN") != std::string::npos;  // inf, nan
  const bool zero = text.find_first_of("123456789") >= text.find_first_of("eE");
  if ((std::isinf(parsed) && !named) || (parsed == 0 && !zero))
    return {end, std::errc::result_out_of_range};
  value = parsed;
  return {end, std::errc()};
}

template <typename Integer, typename = std::enable_if_t<std::is_integral_v<Integer>>>
std::from_chars_result from_chars(const char* first, const char* last, Integer& value) {
  return std::from_chars(first, last, value);
}

#endif

}  // namespace gpureg::files
