// SPDX-License-Identifier: BSD-3-Clause
#include "cuda/device/lanes.hpp"

#include <algorithm>

namespace gpureg::cuda {

Lanes::Lanes(int device) {
  for (auto& exec : execs_) exec = std::make_unique<Exec>(device, uploader_);
  for (auto& exec : execs_)
    for (auto& other : execs_) exec->memory()->take_from(other->memory());
}

Lanes::Held Lanes::any() {
  std::unique_lock<std::mutex> lock(mutex_);
  std::size_t lane = kLanes;
  freed_.wait(lock, [&] {
    lane = 0;
    while (lane < kLanes && (busy_[lane] || wanted_[lane] > 0)) ++lane;
    return lane < kLanes;
  });
  busy_[lane] = true;
  return {*this, lane, 1};
}

Lanes::Held Lanes::take(std::size_t first, std::size_t count) {
  std::unique_lock<std::mutex> lock(mutex_);
  const std::size_t end = first + count;
  for (std::size_t k = first; k < end; ++k) ++wanted_[k];
  freed_.wait(lock, [&] {
    return std::none_of(busy_.data() + first, busy_.data() + end, [](bool busy) { return busy; });
  });
  for (std::size_t k = first; k < end; ++k) {
    --wanted_[k];
    busy_[k] = true;
  }
  return {*this, first, count};
}

Lanes::Held::~Held() {
  if (std::uncaught_exceptions() > exceptions_) wait();
  lanes_.release(first_, count_);
}

void Lanes::Held::wait() const noexcept {
  for (std::size_t k = 0; k < count_; ++k) cudaStreamSynchronize(exec(k).stream());
}

void Lanes::release(std::size_t first, std::size_t count) {
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    for (std::size_t k = first; k < first + count; ++k) busy_[k] = false;
  }
  freed_.notify_all();
}

void Lanes::trim() {
  const Held held = all();
  // A lane may read clouds in the memory of another one.
  for (std::size_t k = 0; k < kLanes; ++k) held.exec(k).synchronize();
  for (std::size_t k = 0; k < kLanes; ++k) held.exec(k).trim();
  uploader_->clear();
}

}  // namespace gpureg::cuda
