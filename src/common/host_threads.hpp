// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <exception>
#include <thread>
#include <vector>

namespace gpureg {

/// Calls work(thread) on `threads` threads, the first of them the calling thread. Waits for all,
/// then rethrows the exception of the first thread that failed.
template <typename Work>
void on_threads(std::size_t threads, const Work& work) {
  std::vector<std::exception_ptr> failed(threads);
  const auto guarded = [&](std::size_t thread) {
    try {
      work(thread);
    } catch (...) {
      failed[thread] = std::current_exception();
    }
  };
  std::vector<std::thread> others;
  for (std::size_t k = 1; k < threads; ++k) others.emplace_back(guarded, k);
  guarded(0);
  for (std::thread& thread : others) thread.join();
  for (const std::exception_ptr& error : failed)
    if (error) std::rethrow_exception(error);
}

}  // namespace gpureg
