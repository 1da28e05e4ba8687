// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <cstdint>
#include <map>
#include <string>
#include <vector>

namespace gpureg::cli {

std::string fixed(double value, int digits);        ///< 12.35
std::string significant(double value, int digits);  ///< 0.0123, 45.6, 1.2e+06
std::string percent(double ratio);                  ///< 61.3 for 0.613, one digit, no sign
std::string grouped(std::uint64_t value);           ///< 1,234,567
std::string duration(double seconds);               ///< 0:07, 12:30, 1:02:03
std::string shortest(double value);                 ///< reads back as the same number
/// "7 too_little_overlap, 3 ambiguous", the most frequent first.
std::string counted(const std::map<std::string, std::size_t>& counts);
std::string base_name(const std::string& path);  ///< last component, trailing slashes ignored
/// The word that a misspelt one may have meant; empty: none is near.
std::string nearest(const std::string& word, const std::vector<std::string>& words);
std::string pad_right(std::string text, std::size_t width);
std::string pad_left(std::string text, std::size_t width);

}  // namespace gpureg::cli
