// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <algorithm>
#include <atomic>
#include <cstddef>

#include "common/host_threads.hpp"

namespace gpureg {

/// Calls work(k, state) for each k < count, with one state of make_state() per thread. Once one of
/// them has thrown, no other begins.
template <typename MakeState, typename Work>
void for_each_on(std::size_t threads, std::size_t count, const MakeState& make_state,
                 const Work& work) {
  std::atomic<std::size_t> next{0};
  on_threads(std::max<std::size_t>(1, std::min(threads, count)), [&](std::size_t) {
    auto state = make_state();
    try {
      for (std::size_t k; (k = next++) < count;) work(k, state);
    } catch (...) {
      next = count;
      throw;
    }
  });
}

/// Calls work(k) for each k < count.
template <typename Work>
void for_each_on(std::size_t threads, std::size_t count, const Work& work) {
  for_each_on(threads, count, [] { return 0; }, [&](std::size_t k, int) { work(k); });
}

}  // namespace gpureg
