// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <map>

#include "algorithm/compatibility.hpp"
#include "algorithm/normal_weight.hpp"
#include "common/radix_sort.hpp"
#include "cpu/common/feature_index.hpp"
#include "cpu/common/stages.hpp"

namespace gpureg::cpu {
namespace {

/// One search of all rows of one cloud in the other.
struct Search {
  FeatureRows from, in;
  const KeptIndex *from_kept, *in_kept;
  bool forward;  ///< from source to target
  std::vector<std::uint32_t> nearest;
  const FeatureIndex *from_index = nullptr, *in_index = nullptr;
};

void add_searches(FeatureRows s, FeatureRows t, const KeptIndex& of_s, const KeptIndex& of_t,
                  std::vector<Search>& out) {
  out.push_back({s, t, &of_s, &of_t, true, std::vector<std::uint32_t>(s.size, kNoValue)});
  out.push_back({t, s, &of_t, &of_s, false, std::vector<std::uint32_t>(t.size, kNoValue)});
}

std::vector<Search> searches_of(const PairView& pair) {
  std::vector<Search> out;
  const CloudView &s = pair.source, &t = pair.target;
  if (pair.custom_count > 0 || s.size == 0 || t.size == 0) return out;
  const auto narrow = [](const CloudView& c) {
    return FeatureRows{c.features, c.has_feature, c.size, c.feature_dimension};
  };
  const auto wide = [](const CloudView& c) {
    return FeatureRows{c.wide_features, c.has_wide_feature, c.size, c.feature_dimension};
  };
  const CpuCloud &kept_s = executor_data(s), &kept_t = executor_data(t);
  add_searches(narrow(s), narrow(t), kept_s.index, kept_t.index, out);
  if (s.wide_features != nullptr && t.wide_features != nullptr)
    add_searches(wide(s), wide(t), kept_s.wide_index, kept_t.wide_index, out);
  return out;
}

/// Finds or makes the indices of all searches, each set of rows once.
void index_rows(Exec& exec, const std::vector<Search*>& searches) {
  std::map<const KeptIndex*, std::pair<FeatureRows, const FeatureIndex*>> kept;
  for (const Search* search : searches) {
    kept[search->from_kept] = {search->from, nullptr};
    kept[search->in_kept] = {search->in, nullptr};
  }
  std::vector<decltype(kept)::value_type*> tasks;
  for (auto& entry : kept) tasks.push_back(&entry);
  exec.parallel(tasks.size(), [&](std::size_t k) {
    tasks[k]->second.second = &tasks[k]->first->of(tasks[k]->second.first);
  });
  for (Search* search : searches) {
    search->from_index = kept[search->from_kept].second;
    search->in_index = kept[search->in_kept].second;
  }
}

std::uint64_t joined(std::uint32_t source, std::uint32_t target) {
  return static_cast<std::uint64_t>(source) << 32 | target;
}

/// Normal-space weights of the kept points.
std::uint64_t normal_weight(const Vec3* normals, const std::vector<std::uint32_t>& index,
                            std::vector<std::uint32_t>& weight) {
  std::uint32_t count[kNormalBins] = {};
  weight.resize(index.size());
  for (std::size_t k = 0; k < index.size(); ++k) ++count[weight[k] = normal_bin(normals[index[k]])];
  std::uint64_t total = 0;
  for (std::uint32_t& w : weight) total += w = normal_weight_in_bin(count[w]);
  return total;
}

MatchSet merge(const PairView& pair, const std::vector<Search>& searches, std::uint64_t seed,
               std::uint32_t most) {
  std::vector<KeyIndex> all;
  all.reserve(pair.custom_count + 2 * (std::size_t(pair.source.size) + pair.target.size));
  for (std::uint32_t c = 0; c < pair.custom_count; ++c)
    all.push_back({joined(pair.custom_source[c], pair.custom_target[c]), 0});
  for (const Search& search : searches)
    for (std::uint32_t k = 0; k < search.nearest.size(); ++k)
      if (search.nearest[k] != kNoValue)
        all.push_back(
            {search.forward ? joined(k, search.nearest[k]) : joined(search.nearest[k], k), 0});
  radix_sort(all);
  all.erase(std::unique(all.begin(), all.end(),
                        [](const KeyIndex& a, const KeyIndex& b) { return a.key == b.key; }),
            all.end());

  // Stable: equal ranks stay in the order of the indices.
  std::vector<KeyIndex> order(all.size());
  for (std::size_t k = 0; k < all.size(); ++k)
    order[k] = {match_order(static_cast<std::uint32_t>(all[k].key >> 32),
                            static_cast<std::uint32_t>(all[k].key), seed),
                static_cast<std::uint32_t>(k)};
  radix_sort(order);
  if (order.size() > most) order.resize(most);

  MatchSet m;
  m.found = static_cast<std::uint32_t>(all.size());
  for (const KeyIndex& entry : order) {
    const std::uint64_t both = all[entry.index].key;
    const std::uint32_t s = static_cast<std::uint32_t>(both >> 32),
                        t = static_cast<std::uint32_t>(both);
    const Vec3 p = pair.source.points[s], q = pair.target.points[t];
    m.source.push_back(s);
    m.target.push_back(t);
    m.px.push_back(p.x);
    m.py.push_back(p.y);
    m.pz.push_back(p.z);
    m.qx.push_back(q.x);
    m.qy.push_back(q.y);
    m.qz.push_back(q.z);
    const Vec3 a = pair.source.normals[s], b = pair.target.normals[t];
    m.mx.push_back(a.x);
    m.my.push_back(a.y);
    m.mz.push_back(a.z);
    m.nx.push_back(b.x);
    m.ny.push_back(b.y);
    m.nz.push_back(b.z);
  }
  m.source_total = normal_weight(pair.source.normals, m.source, m.source_weight);
  m.target_total = normal_weight(pair.target.normals, m.target, m.target_weight);
  return m;
}

}  // namespace

std::vector<MatchSet> merge_matches(Exec& exec, Span<const PairView> pairs,
                                    const RegistrationOptions& options) {
  std::vector<std::vector<Search>> searches(pairs.size);
  std::vector<Search*> flat;
  for (std::size_t p = 0; p < pairs.size; ++p) {
    searches[p] = searches_of(pairs[p]);
    for (Search& search : searches[p]) flat.push_back(&search);
  }
  index_rows(exec, flat);
  constexpr std::size_t kGrain = 512;  // queries per task: milliseconds of work
  exec.parallel_items(
      flat.size(), [&](std::size_t k) { return flat[k]->from_index->rows; }, kGrain,
      [&](std::size_t k, std::size_t begin, std::size_t end) {
        const Search& s = *flat[k];
        nearest_features(s.from, *s.from_index, s.in, *s.in_index, begin, end,
                         flat[k]->nearest.data());
      });
  std::vector<MatchSet> out(pairs.size);
  exec.parallel(pairs.size, [&](std::size_t p) {
    out[p] = merge(pairs[p], searches[p], options.seed, options.compatibility.max_matches);
  });
  return out;
}

}  // namespace gpureg::cpu
