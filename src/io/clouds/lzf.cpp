// SPDX-License-Identifier: BSD-3-Clause
#include "io/clouds/lzf.hpp"

namespace gpureg::io {

// The stream is a sequence of tokens. A first byte below 32 starts a run of that many and one more
// literal bytes. Otherwise its upper three bits are the length of a repetition less 2 (7: a byte
// with the rest of the length follows), and its lower five, with one more byte, the distance back
// less 1.
bool lzf_decompress(std::string_view packed, std::size_t size, std::string& out) {
  out.clear();
  out.reserve(size);
  std::size_t at = 0;
  const auto byte = [&] {
    return static_cast<std::size_t>(static_cast<unsigned char>(packed[at++]));
  };
  while (at < packed.size()) {
    const std::size_t token = byte();
    if (token < 32) {
      const std::size_t run = token + 1;
      if (run > packed.size() - at || run > size - out.size()) return false;
      out.append(packed.substr(at, run));
      at += run;
      continue;
    }
    std::size_t length = token >> 5;
    if (length == 7) {
      if (at == packed.size()) return false;
      length += byte();
    }
    length += 2;
    if (at == packed.size()) return false;
    const std::size_t distance = ((token & 31) << 8) + byte() + 1;
    if (distance > out.size() || length > size - out.size()) return false;
    for (std::size_t from = out.size() - distance; length > 0; --length, ++from)
      out.push_back(out[from]);  // may overlap itself
  }
  return out.size() == size;
}

}  // namespace gpureg::io
