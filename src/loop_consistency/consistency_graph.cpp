// SPDX-License-Identifier: BSD-3-Clause
#include "loop_consistency/consistency_graph.hpp"

#include <algorithm>
#include <cmath>

#include "math/exponential.hpp"
#include "math/trigonometry.hpp"

namespace gpureg {
namespace {

constexpr double kPi = 3.14159265358979323846, kDegrees = 180.0 / kPi;
/// More than the functions of the floor are off.
constexpr double kFloorMargin = 1e-6;

std::vector<ConsistencyCandidate> candidates_of(const RegistrationResult& result, bool turned,
                                                const LoopConsistencyOptions& options) {
  std::vector<ConsistencyCandidate> out;
  const auto add = [&](const UnalignedIsometry3d& target_from_source, double prior,
                       std::size_t mode) {
    out.push_back({turned ? target_from_source.inverse() : target_from_source, prior,
                   static_cast<std::uint32_t>(mode)});
  };
  if (result.modes.empty()) add(result.target_from_source, result.confidence, 0);
  for (std::size_t m = 0; m < result.modes.size() && m < options.modes; ++m)
    if (m == 0 || result.modes[m].confidence >= options.min_alternative_confidence)
      add(result.modes[m].target_from_source,
          m == 0 ? result.confidence : result.modes[m].confidence, m);
  // At most one pose is correct: the alternatives share half of the remaining probability.
  double alternatives = 0;
  for (std::size_t m = 1; m < out.size(); ++m) alternatives += out[m].prior;
  const double room = 0.5 * (1.0 - out.front().prior);
  for (std::size_t m = 1; m < out.size(); ++m)
    out[m].prior *= alternatives > room ? room / alternatives : 1.0;
  return out;
}

/// Pairs in the order of their clouds: sums and searches must not depend on the order of the input.
std::vector<std::size_t> sorted(const std::vector<Pair>& pairs,
                                const std::vector<RegistrationResult>& results) {
  std::vector<std::size_t> order(pairs.size());
  for (std::size_t p = 0; p < order.size(); ++p) order[p] = p;
  std::stable_sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) {
    if (pairs[a].source != pairs[b].source) return pairs[a].source < pairs[b].source;
    if (pairs[a].target != pairs[b].target) return pairs[a].target < pairs[b].target;
    return results[a].confidence > results[b].confidence;
  });
  return order;
}

}  // namespace

std::size_t ConsistencyEdge::most_likely() const {
  return static_cast<std::size_t>(std::max_element(probability.begin(), probability.end()) -
                                  probability.begin());
}

UnalignedIsometry3d ConsistencyEdge::pose(std::size_t candidate, std::uint32_t into) const {
  const UnalignedIsometry3d& t = candidates[candidate].first_from_second;
  return first == into ? t : t.inverse();
}

ConsistencyGraph::ConsistencyGraph(const std::vector<Pair>& pairs,
                                   const std::vector<RegistrationResult>& results,
                                   const LoopConsistencyOptions& options)
    : options_(options), floor_(options) {
  number_clouds(pairs);
  find_centres(pairs, results);
  find_edges(pairs, results);
  find_neighbors();
}

/// Dense numbers by first occurrence, so that memory does not depend on the given indices.
void ConsistencyGraph::number_clouds(const std::vector<Pair>& pairs) {
  for (const Pair& pair : pairs) {
    clouds_.push_back(pair.source);
    clouds_.push_back(pair.target);
  }
  std::sort(clouds_.begin(), clouds_.end());
  clouds_.erase(std::unique(clouds_.begin(), clouds_.end()), clouds_.end());
}
std::uint32_t ConsistencyGraph::number(std::uint32_t cloud) const {
  return static_cast<std::uint32_t>(std::lower_bound(clouds_.begin(), clouds_.end(), cloud) -
                                    clouds_.begin());
}

void ConsistencyGraph::find_centres(const std::vector<Pair>& pairs,
                                    const std::vector<RegistrationResult>& results) {
  centres_.assign(clouds_.size(), Eigen::Vector3d::Zero());
  std::vector<double> weight(clouds_.size(), 0.0);
  const auto add = [&](std::uint32_t cloud, const CorrespondenceMoments& moments) {
    if (moments.count == 0 || !moments.sum.allFinite()) return;
    const std::uint32_t k = number(cloud);
    centres_[k] += moments.sum;
    weight[k] += static_cast<double>(moments.count);
  };
  for (const std::size_t p : sorted(pairs, results)) {
    add(pairs[p].source, results[p].source_moments);
    add(pairs[p].target, results[p].target_moments);
  }
  for (std::size_t k = 0; k < centres_.size(); ++k)
    if (weight[k] > 0) centres_[k] /= weight[k];
}

void ConsistencyGraph::find_edges(const std::vector<Pair>& pairs,
                                  const std::vector<RegistrationResult>& results) {
  for (const std::size_t p : sorted(pairs, results)) {
    const std::uint32_t source = number(pairs[p].source), target = number(pairs[p].target);
    if (!results[p].has_pose() || source == target ||
        results[p].confidence < options_.min_confidence)
      continue;
    ConsistencyEdge edge{std::min(source, target),
                         std::max(source, target),
                         p,
                         candidates_of(results[p], target > source, options_),
                         {}};
    for (const ConsistencyCandidate& c : edge.candidates) edge.probability.push_back(c.prior);
    edges_.push_back(std::move(edge));
  }
}

void ConsistencyGraph::find_neighbors() {
  neighbors_.resize(clouds_.size());
  for (std::uint32_t e = 0; e < edges_.size(); ++e) {
    neighbors_[edges_[e].first].push_back({edges_[e].second, e});
    neighbors_[edges_[e].second].push_back({edges_[e].first, e});
  }
  const auto prior = [&](const ConsistencyNeighbor& n) {
    return edges_[n.edge].candidates.front().prior;
  };
  for (std::vector<ConsistencyNeighbor>& list : neighbors_) {
    // Of pairs that were tried twice only the most confident one counts.
    std::stable_sort(list.begin(), list.end(),
                     [&](const ConsistencyNeighbor& a, const ConsistencyNeighbor& b) {
                       return a.cloud != b.cloud ? a.cloud < b.cloud : prior(a) > prior(b);
                     });
    list.erase(std::unique(list.begin(), list.end(),
                           [](const ConsistencyNeighbor& a, const ConsistencyNeighbor& b) {
                             return a.cloud == b.cloud;
                           }),
               list.end());
    if (list.size() <= options_.neighbors) continue;
    std::stable_sort(list.begin(), list.end(),
                     [&](const ConsistencyNeighbor& a, const ConsistencyNeighbor& b) {
                       return prior(a) > prior(b);
                     });
    list.resize(options_.neighbors);
    std::sort(list.begin(), list.end(),
              [](const ConsistencyNeighbor& a, const ConsistencyNeighbor& b) {
                return a.cloud < b.cloud;
              });
  }
}

ConsistencyGraph::Floor::Floor(const LoopConsistencyOptions& options) {
  const double at_floor =
      -2 * portable::log(options.missed_closure_rate * options.false_closure_rate);
  most = at_floor + kFloorMargin;
  const double angle = static_cast<double>(options.closing_angle) * std::sqrt(most) / kDegrees;
  if (angle < kPi) cosine = portable::cos(angle) - kFloorMargin;
}

double ConsistencyGraph::closing_ratio(const UnalignedIsometry3d& loop, double tolerance,
                                       std::initializer_list<Eigen::Vector3d> points) const {
  const double cosine = (loop.linear().trace() - 1.0) / 2.0;
  if (tolerance == 1.0 && cosine < floor_.cosine) return options_.missed_closure_rate;
  double squared = 0;
  for (const Eigen::Vector3d& p : points) squared = std::max(squared, (loop * p - p).squaredNorm());
  const double distance = tolerance * static_cast<double>(options_.closing_distance);
  const double shift = squared / (distance * distance);
  if (shift > floor_.most) return options_.missed_closure_rate;
  const double angle = kDegrees * portable::acos(std::clamp(cosine, -1.0, 1.0));
  const double turn = angle / (tolerance * static_cast<double>(options_.closing_angle));
  return std::max(options_.missed_closure_rate,
                  portable::exp(-0.5 * (turn * turn + shift)) / options_.false_closure_rate);
}

}  // namespace gpureg
