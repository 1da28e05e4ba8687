// SPDX-License-Identifier: BSD-3-Clause
// The fallback for C++ libraries without floating-point charconv, against the library's own.
#define GPUREG_OWN_NUMBERS
#include "files/numbers.hpp"

#include <gtest/gtest.h>

#include <cstdint>
#include <cstring>
#include <random>

namespace gpureg::files {
namespace {

std::uint64_t bits(double value) {
  std::uint64_t out;
  std::memcpy(&out, &value, sizeof out);
  return out;
}

void expect_same(const std::string& text) {
  const char *const first = text.data(), *const last = first + text.size();
  double own = 7, library = 7;
  const auto a = from_chars(first, last, own);
  const auto b = std::from_chars(first, last, library);
  EXPECT_EQ(a.ec, b.ec) << text;
  EXPECT_EQ(a.ptr - first, b.ptr - first) << text;
  if (own == own || library == library) EXPECT_EQ(bits(own), bits(library)) << text;
}

TEST(Numbers, ReadsAsTheLibrary) {
  for (const char* text : {"0",       "-0",      "1",        "1.5",
                           "-2.25e3", "1e5x",    ".5",       "5.",
                           "-.5e-1",  "1e",      "1e+",      "1e+7",
                           "+1",      "",        "-",        ".",
                           "e5",      "0x10",    " 1",       "nan",
                           "-nan",    "NaN",     "inf",      "-Infinity",
                           "infi",    "1e400",   "-1e400",   "1e-400",
                           "0e-400",  "0.0e400", "4.9e-324", "1.7976931348623157e308",
                           "1,5"})
    expect_same(text);
}

TEST(Numbers, ReadsRandomTextsAsTheLibrary) {
  std::mt19937 random(1);
  const std::string letters = "0123456789.-+eEinfa x,";
  for (int k = 0; k < 100000; ++k) {
    std::string text;
    for (std::size_t size = random() % 9; size > 0; --size)
      text += letters[random() % letters.size()];
    expect_same(text);
  }
}

}  // namespace
}  // namespace gpureg::files
