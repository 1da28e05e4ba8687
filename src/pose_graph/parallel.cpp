// SPDX-License-Identifier: BSD-3-Clause
#include "pose_graph/parallel.hpp"

#include <algorithm>
#include <condition_variable>
#include <cstdint>
#include <mutex>
#include <thread>

#include "common/host_threads.hpp"

namespace gpureg::pose_graph {

void for_ranges(int count, int threads, const std::function<void(int, int)>& body,
                int shortest_range) {
  threads = std::min(threads, count / shortest_range);
  if (threads <= 1) return body(0, count);
  on_threads(static_cast<std::size_t>(threads), [&](std::size_t thread) {
    const int mine = static_cast<int>(thread);
    const auto bound = [&](int k) { return static_cast<int>(std::int64_t(count) * k / threads); };
    body(bound(mine), bound(mine + 1));
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
  on_threads(static_cast<std::size_t>(threads), [&](std::size_t) {
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
