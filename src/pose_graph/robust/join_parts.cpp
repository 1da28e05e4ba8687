// SPDX-License-Identifier: BSD-3-Clause
#include "pose_graph/robust/join_parts.hpp"

#include <algorithm>
#include <map>
#include <set>
#include <tuple>

#include "common/stop_scope.hpp"
#include "math/exponential.hpp"
#include "pose_graph/components.hpp"

namespace gpureg::pose_graph {
namespace {

/// Loops agree with a pose of two parts up to this multiple of their threshold: parts are not as
/// rigid as they are taken here. Twice the distance.
constexpr double kAgreement = 4;
/// Loops of two parts whose poses are tried, the most confident ones; all of them are asked.
constexpr std::size_t kMostTried = 64;
/// Of a confidence whose logarithm is taken.
constexpr double kMostConfidence = 0.9999;

double confidence_of(const ModeTerm& mode) { return portable::logistic(0.5 * mode.prior); }

/// One mode of a loop between two parts.
struct Vote {
  int edge, mode;  ///< mode: relative to the first of the edge
  double weight;   ///< -log of the probability that it is wrong
};

/// Loops that agree about the pose of two parts.
struct Agreement {
  double support = 0;
  Pose motion;  ///< of the second part, in the world
  std::vector<Vote> votes;
};

class Joiner {
 public:
  Joiner(const Problem& problem, const std::vector<char>& known, const std::vector<char>& asked,
         double quantile, Estimate& estimate)
      : problem_(problem), quantile_(quantile), estimate_(estimate), parts_(problem.node_count()) {
    int first_known = -1;
    for (int node = 0; node < problem.node_count(); ++node)
      if (known[node]) {
        if (first_known < 0) first_known = node;
        parts_.merge(first_known, node);
      }
    for (int k = 0; k < problem.edge_count(); ++k)
      if (problem.edges[k].odometry || estimate.selection.weights[k] > 0.5)
        parts_.merge(problem.edges[k].source, problem.edges[k].target);
    fixed_ = first_known < 0 ? 0 : first_known;
    nodes_.resize(problem.node_count());
    for (int node = 0; node < problem.node_count(); ++node) nodes_[part_of(node)].push_back(node);
    between_.resize(problem.node_count());
    for (int k = 0; k < problem.edge_count(); ++k)
      if (asked[k]) add_votes(k);
  }

  bool join() {
    for (int a = 0; a < problem_.node_count(); ++a)
      for (const auto& [b, votes] : between_[a])
        if (a < b) wait(a, b, support_of(votes));
    bool any = false;
    while (!waiting_.empty()) {
      StopScope::poll();
      const auto [minus_bound, a, b] = *waiting_.begin();
      waiting_.erase(waiting_.begin());
      bound_.erase({a, b});
      const Agreement best = best_agreement(a, b);
      // The sum of all votes is a bound: the support of others may be more.
      if (!waiting_.empty() && -best.support > std::get<0>(*waiting_.begin()) &&
          best.support < -minus_bound) {
        wait(a, b, best.support);
        continue;
      }
      merge(a, b, best);
      any = true;
    }
    return any;
  }

 private:
  using Entry = std::tuple<double, int, int>;  ///< minus a bound of the support, parts a < b

  int part_of(int node) { return parts_.find(node); }

  void add_votes(int k) {
    const EdgeTerm& edge = problem_.edges[k];
    const int a = part_of(edge.source), b = part_of(edge.target);
    if (edge.odometry || a == b) return;
    for (int m = 0; m < edge.modes; ++m) {
      const ModeTerm& mode = problem_.modes[edge.first_mode + m];
      if (threshold(mode, quantile_) <= 0) continue;
      const double right = std::min(confidence_of(mode), kMostConfidence);
      const Vote vote{k, m, -portable::log(1 - right)};
      between_[a][b].push_back(vote);
      between_[b][a].push_back(vote);
    }
  }

  /// Of every edge the surest mode.
  static double support_of(const std::vector<Vote>& votes) {
    double sum = 0, most = 0;
    for (std::size_t k = 0; k < votes.size(); ++k) {
      most = std::max(most, votes[k].weight);
      if (k + 1 < votes.size() && votes[k + 1].edge == votes[k].edge) continue;
      sum += most;
      most = 0;
    }
    return sum;
  }

  void wait(int a, int b, double bound) {
    const auto [low, high] = std::minmax(a, b);
    waiting_.insert({-bound, low, high});
    bound_[{low, high}] = bound;
  }

  /// The motion of part b that a vote asks for.
  Pose motion_of(const Vote& vote, int b) {
    const EdgeTerm& edge = problem_.edges[vote.edge];
    const ModeTerm& mode = problem_.modes[edge.first_mode + vote.mode];
    const Pose &source = estimate_.poses[edge.source], &target = estimate_.poses[edge.target];
    return part_of(edge.source) == b ? target * mode.target_from_source * source.inverse()
                                     : source * mode.inverse * target.inverse();
  }

  bool agrees(const Vote& vote, int b, const Pose& motion) {
    const EdgeTerm& edge = problem_.edges[vote.edge];
    const ModeTerm& mode = problem_.modes[edge.first_mode + vote.mode];
    const Pose &source = estimate_.poses[edge.source], &target = estimate_.poses[edge.target];
    const bool moves_source = part_of(edge.source) == b;
    return squared_error(moves_source ? motion * source : source,
                         moves_source ? target : motion * target,
                         mode) <= kAgreement * threshold(mode, quantile_);
  }

  Agreement best_agreement(int a, int b) {
    const std::vector<Vote>& votes = between_[a][b];
    std::vector<std::size_t> tried(votes.size());
    for (std::size_t k = 0; k < votes.size(); ++k) tried[k] = k;
    std::stable_sort(tried.begin(), tried.end(), [&](std::size_t x, std::size_t y) {
      return votes[x].weight > votes[y].weight;
    });
    tried.resize(std::min(tried.size(), kMostTried));
    Agreement best;
    best.support = -1;
    for (const std::size_t k : tried) {
      Agreement here;
      here.motion = motion_of(votes[k], b);
      for (const Vote& vote : votes) {
        if (!agrees(vote, b, here.motion)) continue;
        // Modes of an edge exclude each other.
        if (!here.votes.empty() && here.votes.back().edge == vote.edge) {
          if (vote.weight <= here.votes.back().weight) continue;
          here.support -= here.votes.back().weight;
          here.votes.pop_back();
        }
        here.support += vote.weight;
        here.votes.push_back(vote);
      }
      if (here.support > best.support) best = std::move(here);
    }
    return best;
  }

  /// The part with the pose that is known stays, else the one of more nodes.
  void merge(int a, int b, const Agreement& agreement) {
    const int fixed = part_of(fixed_);
    const bool moves_b = a == fixed || (b != fixed && nodes_[a].size() >= nodes_[b].size());
    const Pose motion = moves_b ? agreement.motion : agreement.motion.inverse();
    for (const int node : nodes_[moves_b ? b : a])
      estimate_.poses[node] = motion * estimate_.poses[node];
    for (const Vote& vote : agreement.votes) {
      estimate_.selection.weights[vote.edge] = 1;
      estimate_.selection.modes[vote.edge] = vote.mode;
    }
    parts_.merge(a, b);
    const int into = part_of(a), from = into == a ? b : a;
    nodes_[into].insert(nodes_[into].end(), nodes_[from].begin(), nodes_[from].end());
    between_[into].erase(from);
    for (auto& [other, votes] : between_[from]) {
      forget(from, other);
      if (other == into) continue;
      forget(into, other);
      std::vector<Vote>& all = between_[into][other];
      const double bound = support_of(all) + support_of(votes);
      all.insert(all.end(), votes.begin(), votes.end());
      std::sort(all.begin(), all.end(), [](const Vote& x, const Vote& y) {
        return std::tie(x.edge, x.mode) < std::tie(y.edge, y.mode);
      });
      between_[other].erase(from);
      between_[other][into] = all;
      wait(into, other, bound);
    }
    between_[from].clear();
  }

  void forget(int a, int b) {
    const auto [low, high] = std::minmax(a, b);
    const auto at = bound_.find({low, high});
    if (at == bound_.end()) return;
    waiting_.erase({-at->second, low, high});
    bound_.erase(at);
  }

  const Problem& problem_;
  double quantile_;
  Estimate& estimate_;
  UnionFind parts_;
  int fixed_ = 0;
  std::vector<std::vector<int>> nodes_;                    ///< of each part
  std::vector<std::map<int, std::vector<Vote>>> between_;  ///< votes by part, ascending by edge
  std::set<Entry> waiting_;
  std::map<std::pair<int, int>, double> bound_;  ///< of the parts that wait
};

}  // namespace

bool join_parts(const Problem& problem, const std::vector<char>& known,
                const std::vector<char>& asked, double quantile, Estimate& estimate) {
  return Joiner(problem, known, asked, quantile, estimate).join();
}

}  // namespace gpureg::pose_graph
