// SPDX-License-Identifier: BSD-3-Clause
#include "reconstruction/audit/blame.hpp"

#include <algorithm>
#include <cmath>
#include <map>
#include <numeric>
#include <set>

#include "reconstruction/audit/common_shift.hpp"

namespace gpureg::reconstruction {
namespace {

/// Log odds of a connection before its pairs are heard.
constexpr double kPrior = 3;
/// An edge of the graph comes before any support that nobody registered. Pairs that ICP moves, of
/// which those across a slip are, come late: a slip is then in one edge of the tree.
constexpr double kOfBond = 10, kOfShift = 0.5;

/// A spanning forest with, for each scan, the way to the root of its island.
class Forest {
 public:
  Forest(const std::vector<std::uint32_t>& islands, const std::vector<Bond>& bonds,
         const std::vector<AuditedPair>& pairs, double noise)
      : islands_(islands), parent_(islands.size()), tree_(islands.size()) {
    std::iota(parent_.begin(), parent_.end(), 0u);
    struct Candidate {
      double weight;
      std::uint32_t a, b;
    };
    std::vector<Candidate> candidates;
    for (const Bond& bond : bonds)
      candidates.push_back({kOfBond + bond.confidence, bond.a, bond.b});
    for (const AuditedPair& pair : pairs)
      if (pair.log_likelihood_ratio > 0)
        candidates.push_back(
            {pair.log_likelihood_ratio + pair.overlap - kOfShift * pair.shift / noise, pair.target,
             pair.source});
    std::stable_sort(candidates.begin(), candidates.end(),
                     [](const Candidate& x, const Candidate& y) { return x.weight > y.weight; });
    for (const Candidate& candidate : candidates) join(candidate.a, candidate.b);
    // Parts that nothing supports are joined one after the other: their cuts are judged, too.
    std::map<std::uint32_t, std::uint32_t> last;
    for (std::uint32_t k = 0; k < islands.size(); ++k) {
      if (islands[k] == kNoIsland) continue;
      const auto [at, first] = last.insert({islands[k], k});
      if (!first) join(at->second, k);
      at->second = k;
    }
    walk();
  }

  /// The scans whose edge to their parent lies on the way between two scans of an island.
  template <typename Function>
  void for_each_edge_between(std::uint32_t a, std::uint32_t b, const Function& function) const {
    while (a != b) {
      std::uint32_t& deeper = depth_[a] >= depth_[b] ? a : b;
      function(deeper);
      deeper = above_[deeper];
    }
  }

  bool is_root(std::uint32_t scan) const { return above_[scan] == scan; }

  /// Scans at and below one, ascending.
  std::vector<std::uint32_t> below(std::uint32_t scan) const {
    std::vector<std::uint32_t> out(order_.begin() + static_cast<std::ptrdiff_t>(begin_[scan]),
                                   order_.begin() + static_cast<std::ptrdiff_t>(end_[scan]));
    std::sort(out.begin(), out.end());
    return out;
  }
  std::size_t size_below(std::uint32_t scan) const { return end_[scan] - begin_[scan]; }

 private:
  std::uint32_t find(std::uint32_t k) {
    while (parent_[k] != k) k = parent_[k] = parent_[parent_[k]];
    return k;
  }

  void join(std::uint32_t a, std::uint32_t b) {
    if (islands_[a] == kNoIsland || islands_[a] != islands_[b] || find(a) == find(b)) return;
    parent_[find(a)] = find(b);
    tree_[a].push_back(b);
    tree_[b].push_back(a);
  }

  /// Depth first from the smallest scan of each island.
  void walk() {
    const std::size_t scans = islands_.size();
    above_.resize(scans);
    depth_.assign(scans, 0);
    begin_.assign(scans, 0);
    end_.assign(scans, 0);
    std::vector<char> seen(scans, 0);
    for (std::uint32_t root = 0; root < scans; ++root) {
      if (seen[root] || islands_[root] == kNoIsland) continue;
      above_[root] = root;
      std::vector<std::pair<std::uint32_t, std::size_t>> stack = {{root, 0}};
      seen[root] = 1;
      begin_[root] = order_.size();
      order_.push_back(root);
      while (!stack.empty()) {
        const std::uint32_t scan = stack.back().first;
        if (stack.back().second == tree_[scan].size()) {
          end_[scan] = order_.size();
          stack.pop_back();
          continue;
        }
        const std::uint32_t next = tree_[scan][stack.back().second++];
        if (seen[next]) continue;
        seen[next] = 1;
        above_[next] = scan;
        depth_[next] = depth_[scan] + 1;
        begin_[next] = order_.size();
        order_.push_back(next);
        stack.push_back({next, 0});
      }
    }
  }

  const std::vector<std::uint32_t>& islands_;
  std::vector<std::uint32_t> parent_, above_, order_;
  std::vector<std::size_t> depth_, begin_, end_;
  std::vector<std::vector<std::uint32_t>> tree_;
};

/// Adds up what pairs of one kind say, the strongest first: every further pair of a scan counts
/// less, as what is wrong with a scan shows in all of its pairs.
class Sum {
 public:
  void add(const AuditedPair& pair, double value) {
    std::size_t &a = used_[pair.source], &b = used_[pair.target];
    sum_ += value / std::sqrt(static_cast<double>((1 + a) * (1 + b)));
    ++a;
    ++b;
  }
  double value() const { return sum_; }

 private:
  std::map<std::uint32_t, std::size_t> used_;
  double sum_ = 0;
};

/// ICP's noise in a right map, of the margin.
constexpr double kNoise = 0.2;

/// Log likelihood ratios of the pairs across a connection, with what a common shift says of those
/// that seem to support it.
std::vector<double> ratios_of(const std::vector<std::size_t>& across,
                              const std::vector<AuditedPair>& pairs, const std::vector<char>& below,
                              const std::vector<UnalignedIsometry3d>& world_from_scan,
                              double noise) {
  std::vector<double> out;
  std::vector<std::size_t> supporters, places;
  for (const std::size_t k : across) {
    if (pairs[k].log_likelihood_ratio > 0) {
      supporters.push_back(k);
      places.push_back(out.size());
    }
    out.push_back(pairs[k].log_likelihood_ratio);
  }
  if (world_from_scan.empty()) return out;
  const std::vector<double> says = common_shift(pairs, supporters, below, world_from_scan, noise);
  for (std::size_t k = 0; k < says.size(); ++k)
    if (says[k] < 0) out[places[k]] = says[k];
  return out;
}

/// @param ratios of the pairs, in the order of `across`.
AuditedConnection judge(const std::vector<std::size_t>& across, const std::vector<double>& ratios,
                        const std::vector<AuditedPair>& pairs, const std::vector<char>& bonded,
                        bool lone, const AuditOptions& options) {
  std::vector<std::size_t> order(across.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::stable_sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) {
    return std::abs(ratios[a]) > std::abs(ratios[b]);
  });
  AuditedConnection out;
  Sum supports, contradictions;
  for (const std::size_t at : order) {
    const std::size_t k = across[at];
    if (ratios[at] < 0) {
      contradictions.add(pairs[k], ratios[at]);
      out.contradictions.push_back(k);
      ++out.contradicting;
    } else {
      // An edge was chosen because its pair looks right: it is part of what is judged. A single
      // scan that was registered with its neighbours has no other support.
      if (lone || !bonded[k]) supports.add(pairs[k], ratios[at]);
      ++out.supporting;
    }
  }
  const double log_odds = kPrior + supports.value() + contradictions.value();
  out.confidence = 1 / (1 + std::exp(-log_odds));
  if (out.contradicting > 0 && out.confidence <= options.max_contradicted)
    out.verdict = ConnectionVerdict::contradicted;
  else if (out.supporting > 0 && out.confidence >= options.min_confirmed)
    out.verdict = ConnectionVerdict::confirmed;
  return out;
}

}  // namespace

std::vector<AuditedConnection> judge_connections(
    const std::vector<std::uint32_t>& islands, const std::vector<Bond>& bonds,
    const std::vector<UnalignedIsometry3d>& world_from_scan, const AuditOptions& options,
    std::vector<AuditedPair>& pairs) {
  const double noise = kNoise * options.max_shift;
  const Forest forest(islands, bonds, pairs, noise);
  std::set<std::pair<std::uint32_t, std::uint32_t>> held;
  for (const Bond& bond : bonds) held.insert(std::minmax(bond.a, bond.b));
  std::vector<char> bonded(pairs.size(), 0);
  std::vector<std::vector<std::size_t>> across(islands.size());
  for (std::size_t k = 0; k < pairs.size(); ++k) {
    bonded[k] = held.count(std::minmax(pairs[k].source, pairs[k].target)) > 0;
    if (pairs[k].log_likelihood_ratio == 0) continue;
    forest.for_each_edge_between(pairs[k].source, pairs[k].target,
                                 [&](std::uint32_t scan) { across[scan].push_back(k); });
  }
  std::map<std::uint32_t, std::size_t> sizes;
  for (const std::uint32_t island : islands) ++sizes[island];
  std::vector<char> explained(pairs.size(), 0);
  std::vector<char> below(islands.size(), 0);
  std::vector<double> ratios;
  const auto judged = [&](std::uint32_t scan) {
    std::vector<std::size_t>& pairs_across = across[scan];
    pairs_across.erase(std::remove_if(pairs_across.begin(), pairs_across.end(),
                                      [&](std::size_t k) { return explained[k] != 0; }),
                       pairs_across.end());
    const std::vector<std::uint32_t> part = forest.below(scan);
    for (const std::uint32_t k : part) below[k] = 1;
    ratios = ratios_of(pairs_across, pairs, below, world_from_scan, noise);
    for (const std::uint32_t k : part) below[k] = 0;
    return judge(pairs_across, ratios, pairs, bonded,
                 std::min(part.size(), sizes[islands[scan]] - part.size()) == 1, options);
  };
  // The worst first: what contradicts it contradicts the connections beside it, too, and is not
  // their fault.
  std::set<std::pair<double, std::uint32_t>> waiting;
  for (std::uint32_t scan = 0; scan < islands.size(); ++scan)
    if (islands[scan] != kNoIsland && !forest.is_root(scan))
      waiting.insert({judged(scan).confidence, scan});
  std::vector<AuditedConnection> out;
  while (!waiting.empty()) {
    const auto [before, scan] = *waiting.begin();
    waiting.erase(waiting.begin());
    AuditedConnection connection = judged(scan);
    if (connection.confidence > before) {
      waiting.insert({connection.confidence, scan});
      continue;
    }
    if (connection.verdict == ConnectionVerdict::contradicted) {
      for (std::size_t k = 0; k < ratios.size(); ++k) {
        AuditedPair& pair = pairs[across[scan][k]];
        pair.log_likelihood_ratio = ratios[k];
        if (ratios[k] < 0) pair.verdict = PairVerdict::contradicts;
      }
      for (const std::size_t k : connection.contradictions) explained[k] = 1;
    }
    connection.scans = forest.below(scan);
    const std::size_t whole = sizes[islands[scan]];
    if (2 * connection.scans.size() > whole) {
      std::vector<std::uint32_t> rest;
      for (std::uint32_t k = 0; k < islands.size(); ++k)
        if (islands[k] == islands[scan] &&
            !std::binary_search(connection.scans.begin(), connection.scans.end(), k))
          rest.push_back(k);
      connection.scans = std::move(rest);
    }
    out.push_back(std::move(connection));
  }
  std::stable_sort(out.begin(), out.end(),
                   [](const AuditedConnection& a, const AuditedConnection& b) {
                     return a.confidence < b.confidence;
                   });
  return out;
}

}  // namespace gpureg::reconstruction
