// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <map>

#include "algorithm/compatibility.hpp"
#include "algorithm/normal_weight.hpp"
#include "algorithm/query_sample.hpp"
#include "common/radix_sort.hpp"
#include "cpu/common/feature_index.hpp"
#include "cpu/common/stages.hpp"

namespace gpureg::cpu {
namespace {

/// One search of rows of one cloud in the other.
struct Search {
  FeatureRows from, in;
  const KeptIndex *from_kept, *in_kept;
  bool forward;  ///< from source to target
  QuerySample sample;
  std::vector<std::uint32_t> nearest;  ///< per row
  const FeatureIndex *from_index = nullptr, *in_index = nullptr;
  std::vector<std::uint32_t> places = {};  ///< of the queries in their index
};

std::vector<Search> searches_of(const PairView& pair, const RegistrationSettings& options) {
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
  const bool both = s.wide_features != nullptr && t.wide_features != nullptr;
  const auto samples =
      query_samples(s.size, t.size, both ? 4 : 2, options.compatibility.max_matches, options.seed);
  const auto add = [&](FeatureRows from, FeatureRows in, const KeptIndex& of, const KeptIndex& to) {
    out.push_back({from, in, &of, &to, out.size() % 2 == 0, samples[out.size()],
                   std::vector<std::uint32_t>(from.size, kNoValue)});
  };
  add(narrow(s), narrow(t), kept_s.index, kept_t.index);
  add(narrow(t), narrow(s), kept_t.index, kept_s.index);
  if (!both) return out;
  add(wide(s), wide(t), kept_s.wide_index, kept_t.wide_index);
  add(wide(t), wide(s), kept_t.wide_index, kept_s.wide_index);
  return out;
}

/// Places of the sampled rows in their index. Equal rows have one place.
std::vector<std::uint32_t> places_of(const QuerySample& sample, const FeatureIndex& index) {
  std::vector<bool> asked(sample.rows, false);
  for (std::uint32_t k = 0; k < sample.count; ++k) asked[sample.row(k)] = true;
  std::vector<std::uint32_t> out;
  for (std::uint32_t place = 0; place < index.rows; ++place) {
    std::uint32_t row = index.row[place];
    while (row != kNoValue && !asked[row]) row = index.next_equal[row];
    if (row != kNoValue) out.push_back(place);
  }
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
  std::size_t most_found = pair.custom_count;
  for (const Search& search : searches) most_found += search.sample.count;
  all.reserve(most_found);
  for (std::uint32_t c = 0; c < pair.custom_count; ++c)
    all.push_back({joined(pair.custom_source[c], pair.custom_target[c]), 0});
  for (const Search& search : searches)
    for (std::uint32_t k = 0; k < search.sample.count; ++k) {
      const std::uint32_t row = search.sample.row(k), near = search.nearest[row];
      if (near != kNoValue)
        all.push_back({search.forward ? joined(row, near) : joined(near, row), 0});
    }
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
                                    const RegistrationSettings& options) {
  std::vector<std::vector<Search>> searches(pairs.size);
  std::vector<Search*> flat;
  for (std::size_t p = 0; p < pairs.size; ++p) {
    searches[p] = searches_of(pairs[p], options);
    for (Search& search : searches[p]) flat.push_back(&search);
  }
  index_rows(exec, flat);
  exec.parallel(flat.size(), [&](std::size_t k) {
    flat[k]->places = places_of(flat[k]->sample, *flat[k]->from_index);
  });
  constexpr std::size_t kGrain = 512;  // queries per task: milliseconds of work
  exec.parallel_items(
      flat.size(), [&](std::size_t k) { return flat[k]->places.size(); }, kGrain,
      [&](std::size_t k, std::size_t begin, std::size_t end) {
        const Search& s = *flat[k];
        nearest_features(s.from, *s.from_index, s.places, s.in, *s.in_index, begin, end,
                         flat[k]->nearest.data());
      });
  std::vector<MatchSet> out(pairs.size);
  exec.parallel(pairs.size, [&](std::size_t p) {
    out[p] = merge(pairs[p], searches[p], options.seed, options.compatibility.max_matches);
  });
  return out;
}

}  // namespace gpureg::cpu
