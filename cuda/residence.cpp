// SPDX-License-Identifier: BSD-3-Clause
#include "residence.hpp"

#include <algorithm>
#include <string>

#include "gpureg/error.hpp"

namespace gpureg::cuda {

Residence::Entry* Residence::find(const Fragment& fragment) {
  for (Entry& entry : entries_)
    if (!entry.fragment.expired() && entry.fragment.lock().get() == &fragment) return &entry;
  return nullptr;
}

void Residence::add(const Fragment& fragment) {
  if (budget_ > 0) entries_.push_back({fragment.weak_from_this(), ++clock_});
}

void Residence::make_room(std::size_t more, const std::vector<const Fragment*>& kept) {
  if (budget_ == 0) return;
  entries_.erase(std::remove_if(entries_.begin(), entries_.end(),
                                [](const Entry& e) { return e.fragment.expired(); }),
                 entries_.end());
  std::sort(entries_.begin(), entries_.end(),
            [](const Entry& a, const Entry& b) { return a.used < b.used; });
  std::size_t bytes = more;
  for (const Entry& entry : entries_)
    if (const auto fragment = entry.fragment.lock()) bytes += fragment->bytes();
  for (Entry& entry : entries_) {
    if (bytes <= budget_) break;
    const auto fragment = entry.fragment.lock();
    if (!fragment || std::find(kept.begin(), kept.end(), fragment.get()) != kept.end()) continue;
    evictions_ += fragment->evict(*exec_.memory());
    bytes -= std::min(bytes, fragment->bytes());
    entry.fragment.reset();
  }
  entries_.erase(std::remove_if(entries_.begin(), entries_.end(),
                                [](const Entry& e) { return e.fragment.expired(); }),
                 entries_.end());
  if (bytes > budget_ && more > 0)
    throw DeviceError("memory_budget is " + std::to_string(budget_) +
                      " bytes, but the prepared clouds that are needed at once take " +
                      std::to_string(bytes) + "; the context stays usable");
}

std::vector<std::shared_ptr<const CudaCloud>> Residence::bring(
    const std::vector<const Fragment*>& fragments) {
  std::vector<std::shared_ptr<const CudaCloud>> out;
  std::vector<std::size_t> missing;
  std::size_t bytes = 0;
  for (std::size_t k = 0; k < fragments.size(); ++k) {
    out.push_back(fragments[k]->on(exec_.device()));
    if (!out.back()) {
      missing.push_back(k);
      bytes += fragments[k]->bytes();
    }
    if (Entry* entry = budget_ > 0 ? find(*fragments[k]) : nullptr) entry->used = ++clock_;
  }
  if (missing.empty()) return out;
  make_room(bytes, fragments);
  for (const std::size_t k : missing) out[k] = fragments[k]->start_copy(exec_);
  exec_.synchronize();
  for (const std::size_t k : missing) {
    fragments[k]->keep(out[k]);
    add(*fragments[k]);
  }
  return out;
}

}  // namespace gpureg::cuda
