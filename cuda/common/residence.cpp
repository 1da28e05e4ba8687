// SPDX-License-Identifier: BSD-3-Clause
#include "cuda/common/residence.hpp"

#include <algorithm>
#include <iterator>
#include <string>
#include <unordered_set>
#include <utility>

#include "gpureg/error.hpp"

namespace gpureg::cuda {

void Residence::add(const PreparedCloud& cloud) {
  const std::lock_guard<std::mutex> lock(mutex_);
  add_locked(cloud);
}

void Residence::make_room(std::size_t more, const std::vector<const PreparedCloud*>& kept) {
  const std::lock_guard<std::mutex> lock(mutex_);
  make_room_locked(more, kept);
}

void Residence::add_locked(const PreparedCloud& cloud) {
  if (budget_ > 0) entries_[&cloud] = {cloud.weak_from_this(), ++clock_};
}

void Residence::forget_expired() {
  for (auto entry = entries_.begin(); entry != entries_.end();)
    entry = entry->second.cloud.expired() ? entries_.erase(entry) : std::next(entry);
}

void Residence::make_room_locked(std::size_t more, const std::vector<const PreparedCloud*>& kept) {
  if (budget_ == 0) return;
  forget_expired();
  const std::unordered_set<const PreparedCloud*> keep(kept.begin(), kept.end());
  std::vector<std::pair<std::uint64_t, std::shared_ptr<const PreparedCloud>>> by_use;
  std::size_t bytes = more;
  for (const auto& [address, entry] : entries_)
    if (auto cloud = entry.cloud.lock()) {
      bytes += cloud->bytes();
      by_use.emplace_back(entry.used, std::move(cloud));
    }
  // Times of use differ: the least recently used goes first.
  std::sort(by_use.begin(), by_use.end());
  for (const auto& [used, cloud] : by_use) {
    if (bytes <= budget_) break;
    if (keep.count(cloud.get()) > 0) continue;
    evictions_ += cloud->evict(*memory_);
    bytes -= std::min(bytes, cloud->bytes());
    entries_.erase(cloud.get());
  }
  if (bytes > budget_ && more > 0)
    throw DeviceError("memory_budget is " + std::to_string(budget_) +
                      " bytes, but the prepared clouds that are needed at once take " +
                      std::to_string(bytes) + "; the context stays usable");
}

std::vector<std::shared_ptr<const CudaCloud>> Residence::bring(
    Exec& exec, const std::vector<const PreparedCloud*>& clouds) {
  // A lane that needs what another one copies waits for it.
  const std::lock_guard<std::mutex> lock(mutex_);
  std::vector<std::shared_ptr<const CudaCloud>> out;
  std::vector<std::size_t> missing;
  std::size_t bytes = 0;
  for (std::size_t k = 0; k < clouds.size(); ++k) {
    out.push_back(clouds[k]->on(device()));
    if (!out.back()) {
      missing.push_back(k);
      bytes += clouds[k]->bytes();
    }
    const auto entry = entries_.find(clouds[k]);
    if (entry != entries_.end() && !entry->second.cloud.expired()) entry->second.used = ++clock_;
  }
  if (missing.empty()) return out;
  make_room_locked(bytes, clouds);
  for (const std::size_t k : missing) out[k] = clouds[k]->start_copy(exec);
  exec.synchronize();
  for (const std::size_t k : missing) {
    clouds[k]->keep(out[k]);
    add_locked(*clouds[k]);
  }
  return out;
}

}  // namespace gpureg::cuda
