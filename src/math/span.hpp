// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>

#include "math/hd.hpp"

namespace gpureg {

/// Non-owning array in host or device memory.
template <typename T>
struct Span {
  T* data = nullptr;
  std::size_t size = 0;

  GPUREG_HD T& operator[](std::size_t i) const { return data[i]; }
  GPUREG_HD T* begin() const { return data; }
  GPUREG_HD T* end() const { return data + size; }
};

template <typename Container>
auto span_of(const Container& c) {
  return Span<const typename Container::value_type>{c.data(), c.size()};
}

}  // namespace gpureg
