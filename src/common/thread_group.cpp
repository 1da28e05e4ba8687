// SPDX-License-Identifier: BSD-3-Clause
#include "common/thread_group.hpp"

#include <algorithm>

#include "common/host_threads.hpp"

namespace gpureg {

ThreadGroup::ThreadGroup(std::size_t threads)
    : helpers_(start_threads(threads > 0 ? threads - 1 : 0,
                             [this](std::size_t) { return std::thread([this] { help(); }); })) {}

ThreadGroup::~ThreadGroup() {
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    stop_ = true;
  }
  wake_.notify_all();
  for (std::thread& helper : helpers_) helper.join();
}

void ThreadGroup::parallel(std::size_t count, const std::function<void(std::size_t)>& work) {
  Loop loop{work, count, {}, 0, {}};
  if (count < 2 || helpers_.empty()) {
    for (std::size_t k = 0; k < count; ++k) work(k);
    return;
  }
  std::list<Loop*>::iterator place;
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    place = loops_.insert(loops_.end(), &loop);
  }
  wake_.notify_all();
  run(loop);
  std::unique_lock<std::mutex> lock(mutex_);
  loops_.erase(place);
  helped_.wait(lock, [&] { return loop.helpers == 0; });
  if (loop.error) std::rethrow_exception(loop.error);
}

void ThreadGroup::run(Loop& loop) {
  try {
    for (std::size_t k; (k = loop.next++) < loop.count;) loop.work(k);
  } catch (...) {
    loop.next = loop.count;
    const std::lock_guard<std::mutex> lock(mutex_);
    if (!loop.error) loop.error = std::current_exception();
  }
}

void ThreadGroup::help() {
  std::unique_lock<std::mutex> lock(mutex_);
  for (;;) {
    const auto open = std::find_if(loops_.begin(), loops_.end(),
                                   [](const Loop* loop) { return loop->next < loop->count; });
    if (open == loops_.end()) {
      if (stop_) return;
      wake_.wait(lock);
      continue;
    }
    Loop& loop = **open;
    ++loop.helpers;
    lock.unlock();
    run(loop);
    lock.lock();
    if (--loop.helpers == 0) helped_.notify_all();
  }
}

}  // namespace gpureg
