// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <type_traits>
#include <utility>

namespace gpureg::test {

namespace detail {
struct Anything {
  template <typename T>
  operator T() const;  // never called
};
template <typename T, std::size_t... K>
auto initialised(std::index_sequence<K...>) -> decltype(T{(void(K), Anything{})...});
template <typename T, std::size_t N, typename = void>
constexpr bool takes = false;
template <typename T, std::size_t N>
constexpr bool takes<T, N, std::void_t<decltype(initialised<T>(std::make_index_sequence<N>{}))>> =
    true;
}  // namespace detail

/// Number of members of an aggregate: the most initialisers that it takes.
template <typename T, std::size_t N = 0>
constexpr std::size_t member_count() {
  static_assert(std::is_aggregate_v<T>);
  if constexpr (detail::takes<T, N + 1>)
    return member_count<T, N + 1>();
  else
    return N;
}

}  // namespace gpureg::test
