// SPDX-License-Identifier: BSD-3-Clause
#include "reconstruction/audit/blame.hpp"

#include <algorithm>
#include <cmath>
#include <map>
#include <numeric>
#include <set>
#include <unordered_map>

#include "common/stop_scope.hpp"
#include "math/exponential.hpp"
#include "math/philox.hpp"
#include "reconstruction/audit/common_shift.hpp"

namespace gpureg::reconstruction {
namespace {

/// Log odds of a connection before its pairs are heard.
constexpr double kPrior = 3;
/// An edge of the graph comes before any support that nobody registered. Pairs that ICP moves, of
/// which those across a slip are, come late: a slip is then in one edge of the tree.
constexpr double kOfBond = 10, kOfMove = 0.5;

/// An edge was chosen because its pair looks right, so what its pair supports is part of what is
/// judged and counts less. Of 120 scans of a house, all pairs, right cuts have 115 such pairs for
/// 34 that contradict, wrong ones 26 for 382. 0 takes four of five right maps apart, 0.25 two, 0.5
/// and 1 none; what is wrong is found with all of them.
constexpr double kOfChosen = 0.5;

/// Pairs across one connection that are heard. Where there are more, as along a corridor that was
/// walked there and back, they are drawn without regard to what they say.
constexpr std::size_t kMostAcross = 1024;

/// A spanning forest with, for each scan, the way to the root of its island: the scan that has at
/// most half of the others at each side, so that what lies below a scan is the smaller part.
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
            {pair.log_likelihood_ratio + pair.overlap - kOfMove * pair.shift / noise, pair.target,
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

  /// The pairs across the edge from each scan to its parent, ascending, at most kMostAcross.
  std::vector<std::vector<std::uint32_t>> pairs_across(
      const std::vector<AuditedPair>& pairs) const {
    std::vector<std::vector<std::uint32_t>> across(islands_.size());
    // The nearest scan at or above one whose edge still takes pairs.
    std::vector<std::uint32_t> open(islands_.size());
    std::iota(open.begin(), open.end(), 0u);
    const auto opened = [&](std::uint32_t scan) {
      while (open[scan] != scan) scan = open[scan] = open[open[scan]];
      return scan;
    };
    for (const std::uint32_t k : drawn(pairs)) {
      std::uint32_t a = opened(pairs[k].source), b = opened(pairs[k].target);
      while (a != b) {
        std::uint32_t& deeper = depth_[a] >= depth_[b] ? a : b;
        across[deeper].push_back(k);
        if (across[deeper].size() == kMostAcross) open[deeper] = above_[deeper];
        deeper = opened(above_[deeper]);
      }
    }
    for (std::vector<std::uint32_t>& of_scan : across) std::sort(of_scan.begin(), of_scan.end());
    return across;
  }

  bool is_root(std::uint32_t scan) const { return above_[scan] == scan; }

  /// Scans in an order in which those at and below one follow each other, from begin_of() on.
  const std::vector<std::uint32_t>& order() const { return order_; }
  std::size_t begin_of(std::uint32_t scan) const { return begin_[scan]; }
  bool is_below(std::uint32_t scan, std::uint32_t above) const {
    return begin_[scan] >= begin_[above] && begin_[scan] < end_[above];
  }
  std::size_t size_below(std::uint32_t scan) const { return end_[scan] - begin_[scan]; }

 private:
  /// Pairs that say something, in a random order that is always the same.
  static std::vector<std::uint32_t> drawn(const std::vector<AuditedPair>& pairs) {
    std::vector<std::uint32_t> out;
    for (std::uint32_t k = 0; k < pairs.size(); ++k)
      if (pairs[k].log_likelihood_ratio != 0) out.push_back(k);
    for (auto k = static_cast<std::uint32_t>(out.size()); k > 1; --k)
      std::swap(out[k - 1], out[scale_to(philox(k, 0, 0, 0, 1, 0).v[0], k)]);
    return out;
  }

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

  /// Each island from its middle.
  void walk() {
    const std::size_t scans = islands_.size();
    above_.resize(scans);
    depth_.assign(scans, 0);
    begin_.assign(scans, 0);
    end_.assign(scans, 0);
    std::vector<char> seen(scans, 0);
    for (std::uint32_t scan = 0; scan < scans; ++scan) {
      if (seen[scan] || islands_[scan] == kNoIsland) continue;
      walk(scan);
      const std::uint32_t middle = middle_of(scan);
      order_.resize(begin_[scan]);
      walk(middle);
      for (std::size_t k = begin_[middle]; k < order_.size(); ++k) seen[order_[k]] = 1;
    }
  }

  /// Depth first.
  void walk(std::uint32_t root) {
    enter(root, root, 0);
    std::vector<std::pair<std::uint32_t, std::size_t>> stack = {{root, 0}};
    while (!stack.empty()) {
      const std::uint32_t scan = stack.back().first;
      if (stack.back().second == tree_[scan].size()) {
        end_[scan] = order_.size();
        stack.pop_back();
        continue;
      }
      const std::uint32_t next = tree_[scan][stack.back().second++];
      if (next == above_[scan]) continue;
      enter(next, scan, depth_[scan] + 1);
      stack.push_back({next, 0});
    }
  }

  void enter(std::uint32_t scan, std::uint32_t above, std::size_t depth) {
    above_[scan] = above;
    depth_[scan] = depth;
    begin_[scan] = order_.size();
    order_.push_back(scan);
  }

  /// The deepest scan at and below which more than half of the island lies.
  std::uint32_t middle_of(std::uint32_t root) const {
    const std::size_t whole = size_below(root);
    std::uint32_t middle = root;
    for (bool more = true; more;) {
      more = false;
      for (const std::uint32_t next : tree_[middle])
        if (next != above_[middle] && 2 * size_below(next) > whole) {
          middle = next;
          more = true;
          break;
        }
    }
    return middle;
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
  std::unordered_map<std::uint32_t, std::size_t> used_;
  double sum_ = 0;
};

/// What ICP finds in a right map of rooms, of its margin, and that margin in metres. Beyond it the
/// noise grows with the square: right poses of LiDAR scans, as of GNSS, are a decimetre off.
constexpr double kNoise = 0.2, kRoomMargin = 0.15;

double noise_of(double max_shift) {
  return kNoise * max_shift * std::max(1.0, max_shift / kRoomMargin);
}

/// Log likelihood ratios of the pairs across a connection, with what a common shift says of those
/// that seem to support it.
std::vector<double> ratios_of(const std::vector<std::uint32_t>& across,
                              const std::vector<AuditedPair>& pairs, const ScansBelow& below,
                              const std::vector<UnalignedIsometry3d>& world_from_scan,
                              double noise) {
  std::vector<double> out;
  std::vector<std::size_t> supporters, places;
  for (const std::uint32_t k : across) {
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
AuditedConnection judge(const std::vector<std::uint32_t>& across, const std::vector<double>& ratios,
                        const std::vector<AuditedPair>& pairs, const std::vector<char>& bonded,
                        bool lone, const AuditOptions& options) {
  std::vector<std::size_t> order(across.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::stable_sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) {
    return std::abs(ratios[a]) > std::abs(ratios[b]);
  });
  AuditedConnection out;
  Sum supports, of_chosen, contradictions;
  for (const std::size_t at : order) {
    const std::uint32_t k = across[at];
    if (ratios[at] < 0) {
      contradictions.add(pairs[k], ratios[at]);
      out.contradictions.push_back(k);
      ++out.contradicting;
    } else {
      // A single scan that was registered with its neighbours has no other support.
      const bool chosen = bonded[k] != 0 && !lone;
      of_chosen.add(pairs[k], (chosen ? kOfChosen : 1) * ratios[at]);
      if (!chosen) supports.add(pairs[k], ratios[at]);
      ++out.supporting;
    }
  }
  const auto confidence_with = [&](const Sum& heard) {
    return portable::logistic(kPrior + heard.value() + contradictions.value());
  };
  // Chosen edges keep a connection from being contradicted. They do not make it surer.
  out.confidence = confidence_with(of_chosen);
  if (out.contradicting == 0 || out.confidence > options.max_contradicted)
    out.confidence = std::max(confidence_with(supports), options.max_contradicted);
  else
    out.verdict = ConnectionVerdict::contradicted;
  if (out.supporting > 0 && out.confidence >= options.min_confirmed)
    out.verdict = ConnectionVerdict::confirmed;
  return out;
}

}  // namespace

void judge_connections(const std::vector<std::uint32_t>& islands, const std::vector<Bond>& bonds,
                       const std::vector<UnalignedIsometry3d>& world_from_scan,
                       const AuditOptions& options, Audit& audit) {
  std::vector<AuditedPair>& pairs = audit.pairs;
  const double noise = noise_of(options.max_shift);
  const Forest forest(islands, bonds, pairs, noise);
  std::set<std::pair<std::uint32_t, std::uint32_t>> held;
  for (const Bond& bond : bonds) held.insert(std::minmax(bond.a, bond.b));
  std::vector<char> bonded(pairs.size(), 0);
  for (std::size_t k = 0; k < pairs.size(); ++k)
    bonded[k] = held.count(std::minmax(pairs[k].source, pairs[k].target)) > 0;
  std::vector<std::vector<std::uint32_t>> across = forest.pairs_across(pairs);
  std::vector<char> explained(pairs.size(), 0);
  std::vector<double> ratios;
  const auto judged = [&](std::uint32_t scan) {
    std::vector<std::uint32_t>& heard = across[scan];
    heard.erase(std::remove_if(heard.begin(), heard.end(),
                               [&](std::uint32_t k) { return explained[k] != 0; }),
                heard.end());
    const auto below = [&](std::uint32_t other) { return forest.is_below(other, scan); };
    ratios = ratios_of(heard, pairs, below, world_from_scan, noise);
    return judge(heard, ratios, pairs, bonded, forest.size_below(scan) == 1, options);
  };
  // The worst first: what contradicts it contradicts the connections beside it, too, and is not
  // their fault.
  std::set<std::pair<double, std::uint32_t>> waiting;
  for (std::uint32_t scan = 0; scan < islands.size(); ++scan)
    if (islands[scan] != kNoIsland && !forest.is_root(scan)) {
      StopScope::poll();
      waiting.insert({judged(scan).confidence, scan});
    }
  std::vector<AuditedConnection>& out = audit.connections;
  out.clear();
  while (!waiting.empty()) {
    StopScope::poll();
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
    connection.island = islands[scan];
    connection.first = forest.begin_of(scan);
    connection.size = forest.size_below(scan);
    out.push_back(std::move(connection));
  }
  std::stable_sort(out.begin(), out.end(),
                   [](const AuditedConnection& a, const AuditedConnection& b) {
                     return a.confidence < b.confidence;
                   });
  audit.order = forest.order();
  audit.islands.clear();
  for (std::uint32_t scan = 0; scan < islands.size(); ++scan) {
    if (islands[scan] == kNoIsland) continue;
    if (islands[scan] >= audit.islands.size()) audit.islands.resize(islands[scan] + 1);
    audit.islands[islands[scan]].scans.push_back(scan);
  }
}

double log_odds_between(const std::vector<AuditedPair>& pairs, const ScansBelow& below,
                        const std::vector<UnalignedIsometry3d>& world_from_scan,
                        const AuditOptions& options) {
  std::vector<std::uint32_t> all;
  for (std::uint32_t k = 0; k < pairs.size(); ++k)
    if (pairs[k].log_likelihood_ratio != 0) all.push_back(k);
  const std::vector<double> ratios =
      ratios_of(all, pairs, below, world_from_scan, noise_of(options.max_shift));
  const double p =
      judge(all, ratios, pairs, std::vector<char>(pairs.size(), 0), true, options).confidence;
  return portable::log(p / (1 - p)) - kPrior;
}

}  // namespace gpureg::reconstruction
