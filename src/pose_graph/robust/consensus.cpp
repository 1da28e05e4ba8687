// SPDX-License-Identifier: BSD-3-Clause
#include "pose_graph/robust/consensus.hpp"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <map>

#include "math/trigonometry.hpp"
#include "pose_graph/components.hpp"
#include "pose_graph/parallel.hpp"
#include "pose_graph/uncertain_pose.hpp"

namespace gpureg::pose_graph {
namespace {

/// Odometry edges at either side of a cycle. Drift makes longer cycles say less.
constexpr int kSteps = 4;
/// Closed cycles after which a mode is not compared any more, and triangles tried per edge: bounds
/// the work on dense graphs.
constexpr int kMaxClosedCycles = 8;
constexpr int kMaxTriangles = 64;
/// Modes of one pair of nodes that are compared with one other mode. A pair has 16 modes at most
/// unless edges are repeated, and repeated edges say nothing new.
constexpr int kMaxParallel = 64;
/// Log of the largest density ratio that one cycle may contribute: covariances are never as exact
/// as small ones pretend.
constexpr double kMostEvidence = 5;
constexpr int kBeliefRounds = 5;

struct Candidate {
  int edge, mode;
  UncertainPose target_from_source;
  double prior;  ///< log odds
};

/// One mode seen from one of its ends.
struct Link {
  int other;  ///< node at the other end
  int candidate;
  bool from_source;
};

struct Neighbour {
  int node;
  UncertainPose here_from_node;
};

struct ClosedCycle {
  int others[2];  ///< candidates; the second is -1 for a cycle of two loops
  double evidence;
};

class Cycles {
 public:
  Cycles(const Problem& problem, double quantile) : problem_(problem), quantile_(quantile) {
    const int nodes = problem.node_count();
    links_.resize(nodes);
    odometry_.resize(nodes);
    std::vector<double> lengths;
    for (int k = 0; k < problem.edge_count(); ++k) {
      const EdgeTerm& edge = problem.edges[k];
      for (int m = 0; m < edge.modes; ++m) {
        const ModeTerm& mode = problem.modes[edge.first_mode + m];
        const UncertainPose pose{mode.target_from_source, covariance_of(mode.information)};
        if (edge.odometry) {
          odometry_[edge.target].push_back({edge.source, pose});
          odometry_[edge.source].push_back({edge.target, pose.inverse()});
          continue;
        }
        if (threshold_of(mode) <= 0) continue;
        const int candidate = static_cast<int>(candidates_.size());
        links_[edge.source].push_back({edge.target, candidate, true});
        links_[edge.target].push_back({edge.source, candidate, false});
        candidates_.push_back({k, m, pose, 0.5 * mode.prior});
        lengths.push_back(mode.target_from_source.translation.norm());
      }
    }
    links_by_other_ = links_;
    const auto by_other = [](const Link& a, const Link& b) { return a.other < b.other; };
    for (std::vector<Link>& links : links_by_other_)
      std::stable_sort(links.begin(), links.end(), by_other);
    // A random pose lies in a ball as large as the loops are long.
    double reach = 1;
    if (!lengths.empty()) {
      const auto high = lengths.begin() + static_cast<std::ptrdiff_t>(lengths.size() * 9 / 10);
      std::nth_element(lengths.begin(), high, lengths.end());
      reach = std::max(1e-3, 2 * *high);
    }
    log_volume_ = portable::log(8 * portable::kPi * portable::kPi) +
                  portable::log(4.0 / 3 * portable::kPi * reach * reach * reach);
  }

  const std::vector<Candidate>& candidates() const { return candidates_; }

  /// What agrees with one candidate. reach: scratch, -1 for every node.
  std::vector<ClosedCycle> closed_cycles(int c, std::vector<int>& reach) const {
    std::vector<ClosedCycle> out;
    const Candidate& mine = candidates_[c];
    const EdgeTerm& edge = problem_.edges[mine.edge];
    const std::vector<Neighbour> near_source = neighbours(edge.source);
    const std::vector<Neighbour> near_target = neighbours(edge.target);
    for (std::size_t k = 0; k < near_target.size(); ++k)
      reach[near_target[k].node] = static_cast<int>(k);
    std::vector<int> compared;
    for (const Neighbour& at : near_source) {
      if (static_cast<int>(out.size()) >= kMaxClosedCycles) break;
      compared.assign(near_target.size(), 0);
      for (const Link& link : links_[at.node]) {
        const int place = reach[link.other];
        if (place < 0 || candidates_[link.candidate].edge == mine.edge) continue;
        if (++compared[place] > kMaxParallel) continue;
        const Neighbour& to = near_target[place];
        if (const double e = evidence(mine, to.here_from_node, seen(link), at.here_from_node))
          out.push_back({{link.candidate, -1}, e});
      }
    }
    for (const Neighbour& at : near_target) reach[at.node] = -1;
    if (static_cast<int>(out.size()) < kMaxClosedCycles) triangles(mine, edge, out);
    return out;
  }

 private:
  double threshold_of(const ModeTerm& mode) const { return quantile_ + mode.prior; }

  /// other_from_here of a link.
  UncertainPose seen(const Link& link) const {
    const UncertainPose& pose = candidates_[link.candidate].target_from_source;
    return link.from_source ? pose : pose.inverse();
  }

  /// Nodes within kSteps odometry edges, nearest first, the node itself among them.
  std::vector<Neighbour> neighbours(int node) const {
    std::vector<Neighbour> out{{node, {}}};
    std::size_t begin = 0;
    for (int step = 0; step < kSteps; ++step) {
      const std::size_t end = out.size();
      for (; begin < end; ++begin)
        for (const Neighbour& next : odometry_[out[begin].node]) {
          const auto same = [&](const Neighbour& n) { return n.node == next.node; };
          if (std::any_of(out.begin(), out.end(), same)) continue;
          out.push_back({next.node, out[begin].here_from_node * next.here_from_node});
        }
    }
    return out;
  }

  /// Log density ratio of the misclosure between a mode and target_from_there * there_from_here *
  /// here_from_source; 0 where they do not agree.
  double evidence(const Candidate& mine, const UncertainPose& target_from_there,
                  const UncertainPose& there_from_here,
                  const UncertainPose& source_from_here) const {
    const Pose here_from_source = source_from_here.pose.inverse();
    const Pose way = target_from_there.pose * there_from_here.pose * here_from_source;
    const Vector6d e = log(mine.target_from_source.pose.inverse() * way);
    // Rotations keep the trace of the rotation's covariance: a bound before any algebra.
    const auto turn = [](const UncertainPose& p) {
      return p.covariance.topLeftCorner<3, 3>().trace();
    };
    const double most = turn(target_from_there) + turn(there_from_here) + turn(source_from_here) +
                        turn(mine.target_from_source);
    if (e.head<3>().squaredNorm() > quantile_ * most) return 0;
    Matrix6d covariance =
        (target_from_there * there_from_here * source_from_here.inverse()).covariance +
        mine.target_from_source.covariance;
    const Eigen::LDLT<Matrix6d> factor(covariance);
    if (factor.info() != Eigen::Success || !(factor.vectorD().minCoeff() > 0)) return 0;
    const double squared = e.dot(factor.solve(e));
    if (!(squared <= quantile_)) return 0;
    constexpr double log_two_pi = 1.8378770664093453;
    double log_determinant = 0;
    for (const double d : factor.vectorD()) log_determinant += portable::log(d);
    const double log_density = -0.5 * (squared + 6 * log_two_pi + log_determinant);
    return std::clamp(log_density + log_volume_, 0.0, kMostEvidence);
  }

  void triangles(const Candidate& mine, const EdgeTerm& edge, std::vector<ClosedCycle>& out) const {
    int tried = 0;
    std::size_t next = 0;
    const std::vector<Link>& to_target = links_by_other_[edge.target];
    for (const Link& first : links_by_other_[edge.source]) {
      while (next < to_target.size() && to_target[next].other < first.other) ++next;
      for (std::size_t k = next; k < to_target.size() && to_target[k].other == first.other; ++k) {
        if (++tried > kMaxTriangles || static_cast<int>(out.size()) >= kMaxClosedCycles) return;
        const UncertainPose third_from_target = seen(to_target[k]);
        if (const double e = evidence(mine, third_from_target.inverse(), seen(first), {}))
          out.push_back({{first.candidate, to_target[k].candidate}, e});
      }
    }
  }

  const Problem& problem_;
  double quantile_;
  double log_volume_ = 0;
  std::vector<Candidate> candidates_;
  std::vector<std::vector<Link>> links_;           ///< of each node
  std::vector<std::vector<Link>> links_by_other_;  ///< the same, sorted by the other node
  std::vector<std::vector<Neighbour>> odometry_;
};

/// Probabilities of the modes given those of the modes that they agree with; the modes of an edge
/// and "none of them" share one unit.
std::vector<double> mode_probabilities(const std::vector<Candidate>& candidates,
                                       const std::vector<std::vector<ClosedCycle>>& closed_cycles) {
  std::vector<double> probability(candidates.size()), odds(candidates.size());
  for (std::size_t c = 0; c < candidates.size(); ++c)
    probability[c] = portable::logistic(candidates[c].prior);
  for (int round = 0; round < kBeliefRounds; ++round) {
    for (std::size_t c = 0; c < candidates.size(); ++c) {
      double sum = candidates[c].prior;
      for (const ClosedCycle& a : closed_cycles[c])
        sum += a.evidence * probability[a.others[0]] *
               (a.others[1] < 0 ? 1 : probability[a.others[1]]);
      odds[c] = portable::exp(std::min(sum, 50.0));
    }
    for (std::size_t begin = 0; begin < candidates.size();) {
      std::size_t end = begin;
      double total = 1;
      for (; end < candidates.size() && candidates[end].edge == candidates[begin].edge; ++end)
        total += odds[end];
      for (; begin < end; ++begin) probability[begin] = odds[begin] / total;
    }
  }
  return probability;
}

}  // namespace

Consensus find_consensus(const Problem& problem, double quantile, int threads) {
  const Cycles cycles(problem, quantile);
  const std::vector<Candidate>& candidates = cycles.candidates();
  std::vector<std::vector<ClosedCycle>> closed_cycles(candidates.size());
  for_ranges(static_cast<int>(candidates.size()), threads, [&](int begin, int end) {
    std::vector<int> reach(problem.ids.size(), -1);
    for (int c = begin; c < end; ++c) closed_cycles[c] = cycles.closed_cycles(c, reach);
  });
  const std::vector<double> probability = mode_probabilities(candidates, closed_cycles);

  Consensus out;
  out.modes.assign(problem.edges.size(), 0);
  out.probability.assign(problem.edges.size(), 0);
  out.cluster_size.assign(problem.edges.size(), 1);
  std::vector<int> best(problem.edges.size(), -1);
  for (std::size_t c = 0; c < candidates.size(); ++c) {
    const int edge = candidates[c].edge;
    if (best[edge] >= 0 && probability[c] <= out.probability[edge]) continue;
    best[edge] = static_cast<int>(c);
    out.probability[edge] = probability[c];
    out.modes[edge] = candidates[c].mode;
  }
  UnionFind sets(problem.edge_count());
  for (std::size_t c = 0; c < candidates.size(); ++c) {
    if (best[candidates[c].edge] != static_cast<int>(c)) continue;
    for (const ClosedCycle& a : closed_cycles[c])
      for (const int other : a.others)
        if (other >= 0 && best[candidates[other].edge] == other &&
            (a.others[1] < 0 || best[candidates[a.others[0]].edge] == a.others[0]))
          sets.merge(candidates[c].edge, candidates[other].edge);
  }
  std::map<int, int> sizes;
  for (int k = 0; k < problem.edge_count(); ++k)
    if (best[k] >= 0) ++sizes[sets.find(k)];
  for (int k = 0; k < problem.edge_count(); ++k)
    if (best[k] >= 0) {
      out.cluster_size[k] = sizes[sets.find(k)];
      out.largest_cluster = std::max(out.largest_cluster, out.cluster_size[k]);
    }
  return out;
}

}  // namespace gpureg::pose_graph
