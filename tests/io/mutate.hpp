// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <algorithm>
#include <array>
#include <random>
#include <string>

namespace gpureg::test {

/// content with one to six random changes: bytes, numbers, cuts, repetitions, words of the formats.
inline std::string mutate(std::string content, std::mt19937_64& random) {
  static const std::array<std::string, 34> words = {"-1",
                                                    "0",
                                                    "1",
                                                    "99999999999",
                                                    "2147483647",
                                                    "2147483648",
                                                    "4294967295",
                                                    "18446744073709551615",
                                                    "999999999999999999",
                                                    "1e999",
                                                    "1e-999",
                                                    "nan",
                                                    "-inf",
                                                    "0x10",
                                                    "\n",
                                                    "\r\n",
                                                    " ",
                                                    "#",
                                                    "element vertex 7\n",
                                                    "element face 999999999999999999\n",
                                                    "property list uchar int i\n",
                                                    "property list int double l\n",
                                                    "property float x\n",
                                                    "end_header\n",
                                                    "format ascii 1.0\n",
                                                    "COUNT 1 65536 1\n",
                                                    "COUNT 1 1 65537\n",
                                                    "WIDTH 2147483647\n",
                                                    "HEIGHT 2147483647\n",
                                                    "POINTS 4611686014132420609\n",
                                                    "DATA binary_compressed\n",
                                                    "SIZE 8 8 8\n",
                                                    "binary_big_endian",
                                                    std::string("\0\0\0\0", 4)};
  const auto below = [&](std::size_t n) {
    return n == 0 ? std::size_t{0} : static_cast<std::size_t>(random() % n);
  };
  for (std::size_t changes = 1 + below(6); changes > 0; --changes) {
    const std::size_t at = below(content.size() + 1);
    switch (below(7)) {
      case 0:
        if (at < content.size()) content[at] = static_cast<char>(random());
        break;
      case 1:
        if (at < content.size()) content[at] = static_cast<char>(content[at] ^ (1 << below(8)));
        break;
      case 2:
        content.insert(at, words[below(words.size())]);
        break;
      case 3: {
        // a number of the text is what lies most dangerously
        const auto digit = content.find_first_of("0123456789", at);
        if (digit == content.npos) break;
        const auto end = std::min(content.find_first_not_of("0123456789", digit), content.size());
        content.replace(digit, end - digit, words[below(9)]);
        break;
      }
      case 4:
        content.resize(at);
        break;
      case 5:
        content.erase(at, 1 + below(20));
        break;
      default:
        content.insert(at, content.substr(below(content.size() + 1), below(200)));
    }
  }
  return content;
}

}  // namespace gpureg::test
