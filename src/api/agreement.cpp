// SPDX-License-Identifier: BSD-3-Clause
#include "gpureg/agreement.hpp"

#include <algorithm>
#include <cmath>
#include <string>

#include "api/validate.hpp"

namespace gpureg {
namespace {

constexpr double kDegrees = 180.0 / 3.14159265358979323846;
/// Nothing is so certain that loops could not speak against it.
constexpr double kLeastDoubt = 1e-6;

/// A pose of a pair that takes part, from its second cloud into its first one.
struct Candidate {
  UnalignedIsometry3d first_from_second;
  double prior;
  std::uint32_t mode;
};

/// A pair that takes part; first < second are dense numbers of clouds.
struct Edge {
  std::uint32_t first, second;
  std::size_t pair;
  std::vector<Candidate> candidates;
  std::vector<double> belief;
  std::uint32_t loops = 0;
};

/// The edge by which a cloud knows another one.
struct Neighbor {
  std::uint32_t cloud;
  std::uint32_t edge;
};

double probability(double value, const std::string& name) {
  require(std::isfinite(value) && value >= 0 && value <= 1, name.c_str(), value,
          "a probability in [0, 1]");
  return value;
}

const UnalignedIsometry3d& rigid(const UnalignedIsometry3d& pose, const std::string& name) {
  const Eigen::Matrix3d r = pose.linear();
  const bool fine =
      pose.matrix().allFinite() &&
      (r * r.transpose() - Eigen::Matrix3d::Identity()).cwiseAbs().maxCoeff() < 1e-3 &&
      r.determinant() > 0 &&
      (pose.matrix().row(3) - Eigen::RowVector4d(0, 0, 0, 1)).cwiseAbs().maxCoeff() == 0;
  if (!fine) throw InvalidArgument(name + " is no rigid motion");
  return pose;
}

void check(const std::vector<Pair>& pairs, const std::vector<RegistrationResult>& results) {
  if (results.size() != pairs.size())
    throw InvalidArgument("results has " + std::to_string(results.size()) +
                          " entries, but pairs has " + std::to_string(pairs.size()));
  for (std::size_t p = 0; p < results.size(); ++p) {
    const std::string name = "results[" + std::to_string(p) + "]";
    probability(results[p].score, name + ".score");
    if (results[p].has_candidate)
      rigid(results[p].target_from_source, name + ".target_from_source");
    for (std::size_t m = 0; m < results[p].modes.size(); ++m) {
      const std::string mode = name + ".modes[" + std::to_string(m) + "]";
      probability(results[p].modes[m].confidence, mode + ".confidence");
      rigid(results[p].modes[m].target_from_source, mode + ".target_from_source");
    }
  }
}

std::vector<Candidate> candidates_of(const RegistrationResult& result, bool turned,
                                     const AgreementOptions& options) {
  std::vector<Candidate> out;
  const auto add = [&](const UnalignedIsometry3d& target_from_source, double prior,
                       std::size_t mode) {
    out.push_back({turned ? target_from_source.inverse() : target_from_source, prior,
                   static_cast<std::uint32_t>(mode)});
  };
  if (result.modes.empty()) add(result.target_from_source, result.score, 0);
  for (std::size_t m = 0; m < result.modes.size() && m < options.modes; ++m)
    if (m == 0 || result.modes[m].confidence >= options.min_rival)
      add(result.modes[m].target_from_source, m == 0 ? result.score : result.modes[m].confidence,
          m);
  // At most one pose is right: rivals share half of what the first one leaves.
  double rivals = 0;
  for (std::size_t m = 1; m < out.size(); ++m) rivals += out[m].prior;
  const double room = 0.5 * (1.0 - out.front().prior);
  for (std::size_t m = 1; m < out.size(); ++m) out[m].prior *= rivals > room ? room / rivals : 1.0;
  return out;
}

class Loops {
 public:
  Loops(const std::vector<Pair>& pairs, const std::vector<RegistrationResult>& results,
        const AgreementOptions& options)
      : options_(options), most_(std::log(options.max_factor)) {
    number_clouds(pairs);
    find_centres(pairs, results);
    find_edges(pairs, results);
    find_neighbors();
  }

  const std::vector<Edge>& edges() const { return edges_; }

  /// All beliefs from those of the round before, so that no order matters.
  void update() {
    std::vector<std::vector<double>> next(edges_.size());
    for (std::size_t e = 0; e < edges_.size(); ++e) next[e] = updated(edges_[e]);
    for (std::size_t e = 0; e < edges_.size(); ++e) edges_[e].belief = std::move(next[e]);
  }

 private:
  /// Dense numbers in the order of the caller's: what follows costs what is there, whatever the
  /// numbers are.
  void number_clouds(const std::vector<Pair>& pairs) {
    for (const Pair& pair : pairs) clouds_.push_back(pair.source), clouds_.push_back(pair.target);
    std::sort(clouds_.begin(), clouds_.end());
    clouds_.erase(std::unique(clouds_.begin(), clouds_.end()), clouds_.end());
  }
  std::uint32_t number(std::uint32_t cloud) const {
    return static_cast<std::uint32_t>(std::lower_bound(clouds_.begin(), clouds_.end(), cloud) -
                                      clouds_.begin());
  }

  /// Pairs by their clouds: sums and searches do not depend on the caller's order.
  static std::vector<std::size_t> sorted(const std::vector<Pair>& pairs,
                                         const std::vector<RegistrationResult>& results) {
    std::vector<std::size_t> order(pairs.size());
    for (std::size_t p = 0; p < order.size(); ++p) order[p] = p;
    std::stable_sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) {
      if (pairs[a].source != pairs[b].source) return pairs[a].source < pairs[b].source;
      if (pairs[a].target != pairs[b].target) return pairs[a].target < pairs[b].target;
      return results[a].score > results[b].score;
    });
    return order;
  }

  void find_centres(const std::vector<Pair>& pairs,
                    const std::vector<RegistrationResult>& results) {
    centres_.assign(clouds_.size(), Eigen::Vector3d::Zero());
    std::vector<double> weight(clouds_.size(), 0.0);
    const auto add = [&](std::uint32_t cloud, const CorrespondenceMoments& moments) {
      if (moments.count == 0 || !moments.sum.allFinite()) return;
      const std::uint32_t k = number(cloud);
      centres_[k] += moments.sum;
      weight[k] += static_cast<double>(moments.count);
    };
    for (const std::size_t p : sorted(pairs, results))
      add(pairs[p].source, results[p].source_moments),
          add(pairs[p].target, results[p].target_moments);
    for (std::size_t k = 0; k < centres_.size(); ++k)
      if (weight[k] > 0) centres_[k] /= weight[k];
  }

  void find_edges(const std::vector<Pair>& pairs, const std::vector<RegistrationResult>& results) {
    for (const std::size_t p : sorted(pairs, results)) {
      const std::uint32_t source = number(pairs[p].source), target = number(pairs[p].target);
      if (!results[p].has_candidate || source == target ||
          results[p].score < options_.min_confidence)
        continue;
      Edge edge{std::min(source, target),
                std::max(source, target),
                p,
                candidates_of(results[p], target > source, options_),
                {}};
      for (const Candidate& c : edge.candidates) edge.belief.push_back(c.prior);
      edges_.push_back(std::move(edge));
    }
  }

  void find_neighbors() {
    neighbors_.resize(clouds_.size());
    for (std::uint32_t e = 0; e < edges_.size(); ++e) {
      neighbors_[edges_[e].first].push_back({edges_[e].second, e});
      neighbors_[edges_[e].second].push_back({edges_[e].first, e});
    }
    const auto prior = [&](const Neighbor& n) { return edges_[n.edge].candidates.front().prior; };
    for (std::vector<Neighbor>& list : neighbors_) {
      // Of pairs tried twice the most confident speaks for both.
      std::stable_sort(list.begin(), list.end(), [&](const Neighbor& a, const Neighbor& b) {
        return a.cloud != b.cloud ? a.cloud < b.cloud : prior(a) > prior(b);
      });
      list.erase(
          std::unique(list.begin(), list.end(),
                      [](const Neighbor& a, const Neighbor& b) { return a.cloud == b.cloud; }),
          list.end());
      if (list.size() <= options_.neighbors) continue;
      std::stable_sort(list.begin(), list.end(),
                       [&](const Neighbor& a, const Neighbor& b) { return prior(a) > prior(b); });
      list.resize(options_.neighbors);
      std::sort(list.begin(), list.end(),
                [](const Neighbor& a, const Neighbor& b) { return a.cloud < b.cloud; });
    }
  }

  static UnalignedIsometry3d pose(const Edge& edge, std::size_t candidate, std::uint32_t into) {
    const UnalignedIsometry3d& t = edge.candidates[candidate].first_from_second;
    return edge.first == into ? t : t.inverse();
  }

  /// How much likelier the loop's closing error is when all three poses are right than when one is
  /// not.
  double ratio(std::uint32_t a, std::uint32_t b, std::uint32_t c,
               const UnalignedIsometry3d& a_from_b, const UnalignedIsometry3d& b_from_c,
               const UnalignedIsometry3d& a_from_c) const {
    const UnalignedIsometry3d loop = a_from_b * b_from_c * a_from_c.inverse();
    const double angle =
        kDegrees * std::acos(std::clamp((loop.linear().trace() - 1.0) / 2.0, -1.0, 1.0));
    double squared = 0;
    for (const Eigen::Vector3d& p : {centres_[a], Eigen::Vector3d(a_from_b * centres_[b]),
                                     Eigen::Vector3d(a_from_c * centres_[c])})
      squared = std::max(squared, (loop * p - p).squaredNorm());
    const double turn = angle / static_cast<double>(options_.closing_angle);
    const double shift = squared / (static_cast<double>(options_.closing_distance) *
                                    static_cast<double>(options_.closing_distance));
    return std::max(options_.miss, std::exp(-0.5 * (turn * turn + shift)) / options_.chance);
  }

  /// Adds to the logarithm of each candidate's odds what the loop over the third cloud says; the
  /// other two edges count by their beliefs.
  void listen(const Edge& edge, const Edge& from_first, const Edge& from_second,
              std::uint32_t third, std::vector<double>& log_odds) const {
    double known = 0;
    for (const double p : from_first.belief)
      for (const double q : from_second.belief) known += p * q;
    for (std::size_t m = 0; m < edge.candidates.size(); ++m) {
      const UnalignedIsometry3d& first_from_second = edge.candidates[m].first_from_second;
      double likelihood = std::max(0.0, 1.0 - known);
      for (std::size_t f = 0; f < from_first.candidates.size(); ++f) {
        const UnalignedIsometry3d first_from_third = pose(from_first, f, edge.first);
        for (std::size_t g = 0; g < from_second.candidates.size(); ++g)
          likelihood += from_first.belief[f] * from_second.belief[g] *
                        ratio(edge.first, edge.second, third, first_from_second,
                              pose(from_second, g, edge.second), first_from_third);
      }
      log_odds[m] += std::log(likelihood);
    }
  }

  std::vector<double> updated(Edge& edge) const {
    std::vector<double> log_odds(edge.candidates.size(), 0.0);
    const std::vector<Neighbor>&first = neighbors_[edge.first], &second = neighbors_[edge.second];
    edge.loops = 0;
    for (std::size_t i = 0, j = 0; i < first.size() && j < second.size();) {
      if (first[i].cloud == second[j].cloud) {
        listen(edge, edges_[first[i].edge], edges_[second[j].edge], first[i].cloud, log_odds);
        ++edge.loops, ++i, ++j;
      } else if (first[i].cloud < second[j].cloud) {
        ++i;
      } else {
        ++j;
      }
    }
    std::vector<double> out = edge.belief;
    if (edge.loops == 0) return out;
    double none = 1.0, sum = 0;
    for (std::size_t m = 0; m < out.size(); ++m) {
      none -= edge.candidates[m].prior;
      sum += out[m] = edge.candidates[m].prior * std::exp(std::clamp(log_odds[m], -most_, most_));
    }
    sum += std::max(none, kLeastDoubt);
    for (std::size_t m = 0; m < out.size(); ++m) out[m] = 0.5 * edge.belief[m] + 0.5 * out[m] / sum;
    return out;
  }

  const AgreementOptions& options_;
  const double most_;
  std::vector<std::uint32_t> clouds_;
  std::vector<Eigen::Vector3d> centres_;
  std::vector<Edge> edges_;
  std::vector<std::vector<Neighbor>> neighbors_;
};

void require_between(double value, double low, double high, const char* name,
                     const char* expected) {
  require(std::isfinite(value) && value > low && value < high, name, value, expected);
}

}  // namespace

AgreementOptions AgreementOptions::from_voxel_size(float voxel_size) {
  require(positive(voxel_size), "voxel_size", voxel_size, "a length > 0");
  AgreementOptions options;
  options.closing_distance = 3.0f * voxel_size;
  return options;
}

void AgreementOptions::validate() const {
  require(std::isfinite(closing_angle) && closing_angle > 0 && closing_angle <= 180,
          "closing_angle", closing_angle, "degrees in (0, 180]");
  require(positive(closing_distance), "closing_distance", closing_distance, "a length > 0");
  require_between(chance, 0, 1, "chance", "a probability in (0, 1)");
  require_between(miss, 0, 1, "miss", "a probability in (0, 1)");
  require(std::isfinite(max_factor) && max_factor >= 1, "max_factor", max_factor,
          "a factor of at least 1");
  require(std::isfinite(min_confidence) && min_confidence >= 0 && min_confidence <= 1,
          "min_confidence", min_confidence, "a probability in [0, 1]");
  require(std::isfinite(min_rival) && min_rival >= 0 && min_rival <= 1, "min_rival", min_rival,
          "a probability in [0, 1]");
  require(modes >= 1 && modes <= 16, "modes", modes, "1 to 16");
  require(neighbors >= 2 && neighbors <= 1024, "neighbors", neighbors, "2 to 1024");
  require(rounds >= 1 && rounds <= 100, "rounds", rounds, "1 to 100");
}

std::vector<PairAgreement> agreement(const std::vector<Pair>& pairs,
                                     const std::vector<RegistrationResult>& results,
                                     const AgreementOptions& options) {
  options.validate();
  check(pairs, results);
  Loops loops(pairs, results, options);
  for (std::uint32_t round = 0; round < options.rounds; ++round) loops.update();

  std::vector<PairAgreement> out(pairs.size());
  for (std::size_t p = 0; p < out.size(); ++p) out[p].confidence = results[p].score;
  for (const Edge& edge : loops.edges()) {
    if (edge.loops == 0) continue;
    const std::size_t best = static_cast<std::size_t>(
        std::max_element(edge.belief.begin(), edge.belief.end()) - edge.belief.begin());
    out[edge.pair] = {edge.belief[best], edge.candidates[best].mode, edge.loops};
  }
  return out;
}

}  // namespace gpureg
