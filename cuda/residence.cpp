// SPDX-License-Identifier: BSD-3-Clause
#include "residence.hpp"

#include <algorithm>
#include <iterator>
#include <string>
#include <unordered_set>
#include <utility>

#include "gpureg/error.hpp"

namespace gpureg::cuda {

void Residence::add(const Fragment& fragment) {
  const std::lock_guard<std::mutex> lock(mutex_);
  add_locked(fragment);
}

void Residence::make_room(std::size_t more, const std::vector<const Fragment*>& kept) {
  const std::lock_guard<std::mutex> lock(mutex_);
  make_room_locked(more, kept);
}

void Residence::add_locked(const Fragment& fragment) {
  if (budget_ > 0) entries_[&fragment] = {fragment.weak_from_this(), ++clock_};
}

void Residence::forget_expired() {
  for (auto entry = entries_.begin(); entry != entries_.end();)
    entry = entry->second.fragment.expired() ? entries_.erase(entry) : std::next(entry);
}

void Residence::make_room_locked(std::size_t more, const std::vector<const Fragment*>& kept) {
  if (budget_ == 0) return;
  forget_expired();
  const std::unordered_set<const Fragment*> keep(kept.begin(), kept.end());
  std::vector<std::pair<std::uint64_t, std::shared_ptr<const Fragment>>> by_use;
  std::size_t bytes = more;
  for (const auto& [address, entry] : entries_)
    if (auto fragment = entry.fragment.lock()) {
      bytes += fragment->bytes();
      by_use.emplace_back(entry.used, std::move(fragment));
    }
  // Times of use differ: the least recently used goes first.
  std::sort(by_use.begin(), by_use.end());
  for (const auto& [used, fragment] : by_use) {
    if (bytes <= budget_) break;
    if (keep.count(fragment.get()) > 0) continue;
    evictions_ += fragment->evict(*memory_);
    bytes -= std::min(bytes, fragment->bytes());
    entries_.erase(fragment.get());
  }
  if (bytes > budget_ && more > 0)
    throw DeviceError("memory_budget is " + std::to_string(budget_) +
                      " bytes, but the prepared clouds that are needed at once take " +
                      std::to_string(bytes) + "; the context stays usable");
}

std::vector<std::shared_ptr<const CudaCloud>> Residence::bring(
    Exec& exec, const std::vector<const Fragment*>& fragments) {
  // A lane that needs what another one copies waits for it.
  const std::lock_guard<std::mutex> lock(mutex_);
  std::vector<std::shared_ptr<const CudaCloud>> out;
  std::vector<std::size_t> missing;
  std::size_t bytes = 0;
  for (std::size_t k = 0; k < fragments.size(); ++k) {
    out.push_back(fragments[k]->on(device()));
    if (!out.back()) {
      missing.push_back(k);
      bytes += fragments[k]->bytes();
    }
    const auto entry = entries_.find(fragments[k]);
    if (entry != entries_.end() && !entry->second.fragment.expired()) entry->second.used = ++clock_;
  }
  if (missing.empty()) return out;
  make_room_locked(bytes, fragments);
  for (const std::size_t k : missing) out[k] = fragments[k]->start_copy(exec);
  exec.synchronize();
  for (const std::size_t k : missing) {
    fragments[k]->keep(out[k]);
    add_locked(*fragments[k]);
  }
  return out;
}

}  // namespace gpureg::cuda
