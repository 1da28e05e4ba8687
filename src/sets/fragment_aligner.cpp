// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <list>
#include <map>
#include <numeric>
#include <tuple>
#include <unordered_map>
#include <utility>

#include "gpureg/sets/register_all.hpp"
#include "sets/prepare_fragments.hpp"

namespace gpureg {
namespace {

constexpr std::size_t kTile = 64;
constexpr std::size_t kTogether = 32;    // fragments that are prepared in one go
constexpr std::size_t kPointBytes = 96;  // of a prepared point but for its feature

std::size_t bytes_of(const PreparedCloud& cloud) {
  return cloud.size() * (sizeof(float) * cloud.feature_dimension() + kPointBytes);
}

}  // namespace

class FragmentAligner::State {
 public:
  State(Context context, const FragmentSet& fragments, RegistrationOptions options,
        std::size_t memory)
      : context_(std::move(context)),
        preparer_(context_, fragments, options),
        options_(options),
        memory_(memory) {}

  bool align(const std::vector<Pair>& pairs, const Take& take,
             const std::function<bool()>& should_stop) {
    should_stop_ = should_stop ? should_stop : [] { return false; };
    if (!looked_for_parts_) preparer_.find_parts();
    looked_for_parts_ = true;
    std::vector<std::size_t> group;
    Held held;
    for (std::size_t k = 0; k < pairs.size(); ++k) {
      if (should_stop_()) break;
      const std::size_t both[] = {pairs[k].target, pairs[k].source};
      std::size_t bytes = 0;
      for (const auto& [fragment, cloud] : held) bytes += bytes_of(cloud);
      if (!group.empty() && bytes >= memory_ && !(held.count(both[0]) && held.count(both[1]))) {
        align_group(pairs, group, held, take);
        group.clear();
        for (auto at = held.begin(); at != held.end();)
          at = at->first == both[0] || at->first == both[1] ? std::next(at) : held.erase(at);
      }
      for (const std::size_t fragment : both)
        if (held.count(fragment) == 0)
          if (PreparedCloud cloud = cloud_of(fragment, pairs, k); cloud.valid())
            held.emplace(fragment, std::move(cloud));
      if (held.count(both[0]) && held.count(both[1])) group.push_back(k);
    }
    if (!group.empty()) align_group(pairs, group, held, take);
    return !should_stop_();
  }

  const std::map<std::size_t, std::string>& unusable() const { return unusable_; }
  std::size_t prepared() const { return prepared_; }
  std::size_t bytes() const { return bytes_; }

 private:
  using Held = std::map<std::size_t, PreparedCloud>;

  void align_group(const std::vector<Pair>& pairs, const std::vector<std::size_t>& group,
                   const Held& held, const Take& take) {
    std::vector<PreparedCloud> clouds;
    std::map<std::size_t, std::uint32_t> places;
    for (const auto& [fragment, cloud] : held) {
      places[fragment] = static_cast<std::uint32_t>(clouds.size());
      clouds.push_back(cloud);
    }
    std::vector<Pair> own;
    for (const std::size_t k : group)
      own.push_back({places.at(pairs[k].source), places.at(pairs[k].target)});
    BatchCallbacks callbacks;
    callbacks.should_stop = should_stop_;
    callbacks.on_result = [&](std::size_t k, const RegistrationResult& result) {
      take(group[k], result);
    };
    align_batch(context_, clouds, own, options_, callbacks);
  }

  /// Empty: it cannot be used, or somebody asked for the end.
  PreparedCloud cloud_of(std::size_t wanted, const std::vector<Pair>& pairs, std::size_t from) {
    if (unusable_.count(wanted) > 0) return {};
    if (const auto found = clouds_.find(wanted); found != clouds_.end()) {
      order_.splice(order_.end(), order_, found->second.place);
      return found->second.cloud;
    }
    // Some of what comes next along with it, as far as it leaves room for what is there.
    const std::size_t mean =
        clouds_.empty() ? memory_ : std::max<std::size_t>(1, bytes_ / clouds_.size());
    const std::size_t room = std::clamp<std::size_t>(memory_ / 4 / mean, 1, kTogether);
    std::vector<std::size_t> chosen{wanted};
    for (std::size_t k = from; k < pairs.size() && chosen.size() < room; ++k)
      for (const std::size_t next : {pairs[k].target, pairs[k].source})
        if (chosen.size() < room && clouds_.count(next) == 0 && unusable_.count(next) == 0 &&
            std::find(chosen.begin(), chosen.end(), next) == chosen.end())
          chosen.push_back(next);
    std::vector<PreparedFragment> made =
        preparer_.prepare(chosen, [&](std::size_t) { return !should_stop_(); });
    for (std::size_t k = 0; k < made.size(); ++k) {
      if (!made[k].usable()) {
        unusable_[chosen[k]] = std::move(made[k].reason);
        continue;
      }
      ++prepared_;
      bytes_ += bytes_of(made[k].cloud);
      clouds_[chosen[k]] = {std::move(made[k].cloud), order_.insert(order_.end(), chosen[k])};
    }
    const auto found = clouds_.find(wanted);
    const PreparedCloud cloud = found == clouds_.end() ? PreparedCloud() : found->second.cloud;
    while (bytes_ > memory_ && clouds_.size() > chosen.size()) {
      const auto oldest = clouds_.find(order_.front());
      bytes_ -= bytes_of(oldest->second.cloud);
      clouds_.erase(oldest);
      order_.pop_front();
    }
    return cloud;
  }

  struct Kept {
    PreparedCloud cloud;
    std::list<std::size_t>::iterator place;
  };

  Context context_;
  sets::Preparer preparer_;
  RegistrationOptions options_;
  std::size_t memory_;
  std::function<bool()> should_stop_;
  bool looked_for_parts_ = false;
  std::unordered_map<std::size_t, Kept> clouds_;
  std::list<std::size_t> order_;  // of use, the oldest first
  std::size_t bytes_ = 0, prepared_ = 0;
  std::map<std::size_t, std::string> unusable_;
};

FragmentAligner::FragmentAligner(Context context, const FragmentSet& fragments,
                                 RegistrationOptions options, std::size_t memory)
    : state_(std::make_unique<State>(std::move(context), fragments, options, memory)) {
  options.validate();
}
FragmentAligner::~FragmentAligner() = default;

bool FragmentAligner::align(const std::vector<Pair>& pairs, const Take& take,
                            const std::function<bool()>& should_stop) {
  return state_->align(pairs, take, should_stop);
}
const std::map<std::size_t, std::string>& FragmentAligner::unusable() const {
  return state_->unusable();
}
std::size_t FragmentAligner::prepared() const { return state_->prepared(); }
std::size_t FragmentAligner::bytes() const { return state_->bytes(); }

std::vector<std::size_t> in_tiles(const std::vector<Pair>& pairs) {
  std::vector<std::size_t> order(pairs.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  const auto key = [&](std::size_t k) {
    const auto& [j, i] = pairs[k];
    return std::make_tuple(i / kTile, j / kTile, i, j, k);
  };
  std::sort(order.begin(), order.end(),
            [&](std::size_t a, std::size_t b) { return key(a) < key(b); });
  return order;
}

}  // namespace gpureg
