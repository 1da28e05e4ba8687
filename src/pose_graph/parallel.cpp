// SPDX-License-Identifier: BSD-3-Clause
#include "pose_graph/parallel.hpp"

#include <algorithm>
#include <condition_variable>
#include <cstdint>
#include <exception>
#include <mutex>
#include <system_error>
#include <thread>

namespace gpureg::pose_graph {
namespace {

/// Runs body on so many threads, the calling one among them; rethrows the first exception.
void on_threads(int threads, const std::function<void()>& body) {
  std::exception_ptr error;
  std::mutex mutex;
  const auto guarded = [&] {
    try {
      body();
    } catch (...) {
      const std::lock_guard<std::mutex> lock(mutex);
      if (!error) error = std::current_exception();
    }
  };
  std::vector<std::thread> others;
  try {
    for (int k = 1; k < threads; ++k) others.emplace_back(guarded);
  } catch (const std::system_error&) {
    // The system allows no further thread: those that there are do the work.
  }
  guarded();
  for (std::thread& thread : others) thread.join();
  if (error) std::rethrow_exception(error);
}

}  // namespace

int thread_count(int option) {
  if (option > 0) return option;
  return std::max(1, static_cast<int>(std::thread::hardware_concurrency()));
}

void for_ranges(int count, int threads, const std::function<void(int, int)>& body,
                int shortest_range) {
  threads = std::min(threads, count / shortest_range);
  if (threads <= 1) return body(0, count);
  std::mutex mutex;
  int next = 0;
  const auto bound = [&](int k) { return static_cast<int>(std::int64_t(count) * k / threads); };
  on_threads(threads, [&] {
    for (;;) {
      int mine;
      {
        const std::lock_guard<std::mutex> lock(mutex);
        if (next == threads) return;
        mine = next++;
      }
      body(bound(mine), bound(mine + 1));
    }
  });
}

bool for_each_bottom_up(const std::vector<int>& parent, int threads,
                        const std::function<bool(int)>& body) {
  const int count = static_cast<int>(parent.size());
  if (threads <= 1) {
    for (int node = 0; node < count; ++node)
      if (!body(node)) return false;
    return true;
  }
  std::vector<int> waiting(count, 0), ready;
  for (const int p : parent)
    if (p >= 0) ++waiting[p];
  for (int node = count - 1; node >= 0; --node)
    if (waiting[node] == 0) ready.push_back(node);
  std::mutex mutex;
  std::condition_variable changed;
  int left = count;
  bool good = true;
  on_threads(threads, [&] {
    std::unique_lock<std::mutex> lock(mutex);
    for (;;) {
      changed.wait(lock, [&] { return !good || left == 0 || !ready.empty(); });
      if (!good || left == 0) return;
      const int node = ready.back();
      ready.pop_back();
      lock.unlock();
      bool done = false;
      try {
        done = body(node);
      } catch (...) {
        lock.lock();
        good = false;
        changed.notify_all();
        throw;
      }
      lock.lock();
      --left;
      good = good && done;
      if (parent[node] >= 0 && --waiting[parent[node]] == 0) ready.push_back(parent[node]);
      if (!good || left == 0 || ready.size() > 1) changed.notify_all();
    }
  });
  return good;
}

}  // namespace gpureg::pose_graph
