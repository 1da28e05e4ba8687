// SPDX-License-Identifier: BSD-3-Clause
#include "cpu/common/exec.hpp"

#include "common/host_threads.hpp"
#include "common/stop_scope.hpp"

namespace gpureg::cpu {

Exec::Exec(unsigned threads)
    : workers_(start_threads(threads > 0 ? threads - 1 : 0,
                             [this](std::size_t) { return std::thread([this] { worker(); }); })) {}

Exec::~Exec() {
  {
    std::lock_guard<std::mutex> lock(mutex_);
    stop_ = true;
  }
  wake_.notify_all();
  for (std::thread& t : workers_) t.join();
}

void Exec::run_tasks() {
  // Called with the lock held, returns with it held. Blocks are coarse, so one lock per block is
  // cheap.
  std::unique_lock<std::mutex> lock(mutex_, std::adopt_lock);
  while (next_ < count_ && !error_) {
    const std::size_t k = next_++;
    lock.unlock();
    std::exception_ptr error;
    try {
      StopScope::poll();
      (*task_)(k);
    } catch (...) {
      error = std::current_exception();
    }
    lock.lock();
    if (error && !error_) error_ = error;
  }
  lock.release();
}

void Exec::worker() {
  unsigned long seen = 0;
  std::unique_lock<std::mutex> lock(mutex_);
  for (;;) {
    wake_.wait(lock, [&] { return stop_ || generation_ != seen; });
    if (stop_) return;
    seen = generation_;
    ++running_;
    run_tasks();
    if (--running_ == 0) done_.notify_all();
  }
}

// Asks the StopScope of the caller between the tasks.
void Exec::parallel(std::size_t count, const std::function<void(std::size_t)>& task) {
  if (count == 0) return;
  if (workers_.empty() || count == 1) {
    for (std::size_t k = 0; k < count; ++k) {
      StopScope::poll();
      task(k);
    }
    return;
  }
  std::unique_lock<std::mutex> lock(mutex_);
  task_ = &task;
  next_ = 0;
  count_ = count;
  error_ = nullptr;
  ++generation_;
  wake_.notify_all();
  run_tasks();
  done_.wait(lock, [&] { return running_ == 0; });
  task_ = nullptr;
  count_ = 0;
  if (error_) std::rethrow_exception(error_);
}

}  // namespace gpureg::cpu
