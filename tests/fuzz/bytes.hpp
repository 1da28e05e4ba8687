// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <algorithm>
#include <cstdint>
#include <cstring>
#include <string_view>

namespace gpureg::fuzz {

/// Values taken from the front of an input; zeros once it is used up.
class Bytes {
 public:
  explicit Bytes(std::string_view rest) : rest_(rest) {}
  bool empty() const { return rest_.empty(); }

  template <typename T>
  T take() {
    T value{};
    const std::size_t size = std::min(sizeof value, rest_.size());
    std::memcpy(&value, rest_.data(), size);
    rest_.remove_prefix(size);
    return value;
  }
  std::uint32_t below(std::uint32_t limit) { return take<std::uint16_t>() % limit; }
  bool flag() { return (take<std::uint8_t>() & 1) != 0; }
  /// Mostly a multiple of 1/256 within +-most; sometimes any bits: NaN, infinity, huge, tiny.
  float number(float most) {
    if (take<std::uint8_t>() == 255) return take<float>();
    return static_cast<float>(take<std::int16_t>()) / 32768.0f * most;
  }

 private:
  std::string_view rest_;
};

}  // namespace gpureg::fuzz
