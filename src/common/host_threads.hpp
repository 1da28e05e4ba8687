// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <algorithm>
#include <cstddef>
#include <exception>
#include <thread>
#include <vector>

namespace gpureg {

/// The number of threads that an option asks for; 0: one per core.
inline int thread_count(int option) {
  if (option > 0) return option;
  return std::max(1, static_cast<int>(std::thread::hardware_concurrency()));
}

/// As many of `count` threads as the system starts; start(k) makes thread k. A limit on processes
/// or on memory leaves fewer.
template <typename Start>
std::vector<std::thread> start_threads(std::size_t count, const Start& start) {
  std::vector<std::thread> threads;
  threads.reserve(count);
  try {
    for (std::size_t k = 0; k < count; ++k) threads.push_back(start(k));
  } catch (const std::exception&) {
    // The threads that run must be joined: an exception would end the program here.
  }
  return threads;
}

/// Calls work(thread) on `threads` threads, the first of them the calling thread, which also does
/// the work of threads that the system does not start. Waits for all, then rethrows the exception
/// of the first thread that failed. The works must not wait for each other. start: as
/// start_threads() calls it, with the work of the thread.
template <typename Work, typename Start>
void on_threads(std::size_t threads, const Work& work, const Start& start) {
  std::vector<std::exception_ptr> failed(threads);
  const auto guarded = [&](std::size_t thread) {
    try {
      work(thread);
    } catch (...) {
      failed[thread] = std::current_exception();
    }
  };
  std::vector<std::thread> others =
      start_threads(threads > 0 ? threads - 1 : 0,
                    [&](std::size_t k) { return start([&guarded, k] { guarded(k + 1); }); });
  guarded(0);
  for (std::size_t k = others.size() + 1; k < threads; ++k) guarded(k);
  for (std::thread& thread : others) thread.join();
  for (const std::exception_ptr& error : failed)
    if (error) std::rethrow_exception(error);
}

template <typename Work>
void on_threads(std::size_t threads, const Work& work) {
  on_threads(threads, work, [](auto&& task) { return std::thread(task); });
}

}  // namespace gpureg
