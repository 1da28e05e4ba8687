// SPDX-License-Identifier: BSD-3-Clause
#include "pages/base64.hpp"

#include <cstdint>

namespace gpureg::cli {

std::string base64(const std::string& bytes) {
  static constexpr char kDigits[] =
      "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  std::string text;
  text.reserve((bytes.size() + 2) / 3 * 4);
  for (std::size_t k = 0; k < bytes.size(); k += 3) {
    std::uint32_t word = 0;
    for (std::size_t n = 0; n < 3; ++n)
      word = word << 8 | (k + n < bytes.size() ? static_cast<unsigned char>(bytes[k + n]) : 0u);
    for (std::size_t n = 0; n < 4; ++n)
      text += k + n > bytes.size() ? '=' : kDigits[word >> (18 - 6 * n) & 63];
  }
  return text;
}

}  // namespace gpureg::cli
