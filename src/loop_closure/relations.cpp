// SPDX-License-Identifier: BSD-3-Clause
#include "loop_closure/relations.hpp"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <iterator>
#include <limits>
#include <optional>

#include "loop_closure/accept.hpp"
#include "pose_graph/robust/robust.hpp"

namespace gpureg::loop_closure {
namespace {

/// Odometry edges between the ends of two loops that are compared.
constexpr int kMostHops = 40;
/// Loops agree by chance unless their prediction is this much better than that of odometry.
constexpr double kInformative = 0.5;
/// The same between fragments that odometry does not connect: in radii of a fragment, as places
/// that look alike are hardly nearer to each other than fragments are large; and metres, for
/// fragments without points. What says how much odometry drifts is held to it under the stated
/// drift, what confirms a loop under the drift from which they agree.
constexpr double kNarrowShare = 0.4, kNarrowMetres = 1;
/// Misclosure, in units of the quantile, from which loops contradict each other; in between they
/// say nothing. Registrations have heavier tails than their covariances.
constexpr double kContradiction = 1.5 * 1.5;

/// Share of the agreements under the largest drift that the chosen one has to explain. Some false
/// loops agree under any large drift. bench/loop_closure: 0.5 loses true loops after 2 m of drift,
/// 0.8 keeps more false ones after 0.2 m.
constexpr double kMostAgreements = 0.65;
/// Agreements of loops within a session from which those between sessions do not count; each pair
/// of loops is two.
constexpr std::size_t kEnoughAgreements = 20;
/// Multiple of the stated drift beyond which the rotation of odometry is never thought to be worse:
/// otherwise the estimate explains perceptual aliases that are turned by a right angle.
constexpr double kMostRotationScale = 4;

class Comparison {
 public:
  Comparison(State& state, const Paths& odometry, const Options& options)
      : state_(state),
        odometry_(odometry),
        options_(options),
        quantile_(pose_graph::chi_square_quantile(options.acceptance.drift_probability)) {
    for (const LoopRecord& record : state.loops)
      ends_.emplace_back(odometry.position(record.source), odometry.position(record.target));
  }

  void run() {
    for (std::size_t k = 0; k < state_.loops.size(); ++k) {
      const LoopRecord& record = state_.loops[k];
      bool missing = false;
      for (std::uint32_t m = 0; m < record.modes.size(); ++m)
        missing |= state_.relations.count(record.key(m)) == 0;
      if (missing) compare(k);
    }
  }

 private:
  void compare(std::size_t k) {
    const LoopRecord& own = state_.loops[k];
    by_source_ = odometry_.tree(ends_[k].first, kMostHops);
    by_target_ = odometry_.tree(ends_[k].second, kMostHops);
    for (std::uint32_t m = 0; m < own.modes.size(); ++m) {
      const auto [list, fresh] = state_.relations.try_emplace(own.key(m));
      if (!fresh || !within_drift(own.modes[m], options_)) continue;
      for (std::size_t other = 0; other < state_.loops.size(); ++other) {
        const LoopRecord& theirs = state_.loops[other];
        if (other == k || !near(other)) continue;
        for (std::uint32_t n = 0; n < theirs.modes.size(); ++n) {
          const auto found = state_.relations.find(theirs.key(n));
          if (found == state_.relations.end() || !within_drift(theirs.modes[n], options_)) continue;
          std::optional<Relation> relation = relate(k, own.modes[m], other, theirs.modes[n]);
          if (!relation) continue;
          relation->other = own.key(m);
          found->second.push_back(*relation);
          relation->other = theirs.key(n);
          list->second.push_back(*relation);
        }
      }
    }
  }

  bool near(std::size_t other) const {
    const auto [a, b] = ends_[other];
    return (by_source_.reaches(a) && by_target_.reaches(b)) ||
           (by_source_.reaches(b) && by_target_.reaches(a));
  }

  /// Nothing where neither can be said.
  std::optional<Relation> relate(std::size_t k, const Mode& mine, std::size_t other,
                                 const Mode& theirs) {
    const auto [a, b] = ends_[other];
    const bool straight =
        by_source_.cost(a) + by_target_.cost(b) <= by_source_.cost(b) + by_target_.cost(a);
    const int near_source = straight ? a : b, near_target = straight ? b : a;
    const UncertainPose across = straight ? uncertain(theirs) : uncertain(theirs).inverse();
    const UncertainPose source_from_end = by_source_.root_from(near_source);
    const UncertainPose target_from_end = by_target_.root_from(near_target);
    // Covariances add up along the cycle: that of odometry, which grows with the scale, and that of
    // the loops.
    const auto exact = [](const UncertainPose& pose) {
      return UncertainPose{pose.pose, Matrix6d::Zero()};
    };
    const UncertainPose by_odometry = target_from_end * exact(across) * source_from_end.inverse();
    const UncertainPose by_loop =
        exact(target_from_end) * across * exact(source_from_end).inverse();
    const UncertainPose own = uncertain(mine);
    const Vector6d e = pose_graph::log(own.pose.inverse() * by_odometry.pose);
    const bool scales = by_source_.modelled(near_source) || by_target_.modelled(near_target);
    Relation relation;
    relation.agrees_from = relation.contradicts_below = kDriftScaleCount;
    for (std::uint8_t scale = kDriftScaleCount; scale-- > 0;) {
      const double factor = scales ? kDriftScales[scale] : 1;
      const Matrix6d covariance =
          factor * factor * by_odometry.covariance + by_loop.covariance + own.covariance;
      double misclosure = e.dot(covariance.llt().solve(e));
      if (factor > kMostRotationScale) {
        const Eigen::Matrix3d turn =
            (kMostRotationScale * kMostRotationScale * by_odometry.covariance + by_loop.covariance +
             own.covariance)
                .topLeftCorner<3, 3>();
        misclosure = std::max(misclosure, e.head<3>().dot(turn.llt().solve(e.head<3>())));
      }
      if (misclosure > kContradiction * quantile_) break;
      relation.contradicts_below = scale;
      if (misclosure <= quantile_) relation.agrees_from = scale;
    }
    const int source = ends_[k].first;
    if (relation.agrees_from < kDriftScaleCount) {
      const Coarse& coarse = state_.nodes.at(state_.loops[k].source).coarse();
      const double sigma = sigma_at(by_odometry.covariance, coarse.centre);
      double most = 0;
      if (by_target_.reaches(source)) {
        most = kInformative * sigma_at(by_target_.root_from(source).covariance, coarse.centre);
        relation.confirms = relation.connected = true;
      } else {
        most = std::max(kNarrowShare * coarse.radius, kNarrowMetres);
        const double factor = scales ? kDriftScales[relation.agrees_from] : 1;
        relation.confirms = factor * sigma <= most;
      }
      if (sigma > most) relation.agrees_from = kDriftScaleCount;
    }
    if (relation.agrees_from == kDriftScaleCount && relation.contradicts_below == 0)
      return std::nullopt;
    const Loop &l = state_.loops[k].loop, &o = state_.loops[other].loop;
    relation.independent = l.source != o.source && l.source != o.target && l.target != o.source &&
                           l.target != o.target;
    return relation;
  }

  State& state_;
  const Paths& odometry_;
  const Options& options_;
  double quantile_;
  std::vector<std::pair<int, int>> ends_;  ///< positions of source and target of each loop
  PathTree by_source_, by_target_;
};

}  // namespace

void update_relations(State& state, const Paths& odometry, const Options& options) {
  Comparison(state, odometry, options).run();
}

std::uint8_t drift_scale(const State& state) {
  std::size_t agreeing[kDriftScaleCount] = {}, connected[kDriftScaleCount] = {};
  for (const auto& [key, list] : state.relations)
    for (const Relation& relation : list)
      for (std::uint8_t scale = relation.agrees_from; scale < kDriftScaleCount; ++scale) {
        agreeing[scale] += relation.independent;
        connected[scale] += relation.independent && relation.connected;
      }
  // Between sessions any place may look like any other: what they say counts where nothing else
  // does.
  if (connected[kDriftScaleCount - 1] >= kEnoughAgreements)
    std::copy(std::begin(connected), std::end(connected), std::begin(agreeing));
  const auto explained = [&](std::uint8_t scale) {
    for (auto larger = static_cast<std::uint8_t>(scale + 1); larger < kDriftScaleCount; ++larger) {
      // The prior of the drift: agreements that need an n times larger drift count n^(-1/4).
      const double prior = std::sqrt(std::sqrt(kDriftScales[scale] / kDriftScales[larger]));
      if (static_cast<double>(agreeing[scale]) <
          kMostAgreements * prior * static_cast<double>(agreeing[larger]))
        return false;
    }
    return true;
  };
  std::uint8_t scale = 0;
  while (!explained(scale)) ++scale;
  return scale;
}

std::vector<char> contradicted(const State& state, const std::vector<char>& fits,
                               std::uint8_t scale) {
  const std::size_t count = state.loops.size();
  std::vector<char> out(count, 0);
  std::map<std::uint64_t, std::size_t> place;
  for (std::size_t k = 0; k < count; ++k)
    if (fits[k]) place[state.loops[k].key(state.loops[k].mode)] = k;
  std::vector<double> against(count, 0), balance(count, 0);
  const auto confidence = [&](std::size_t k) {
    const LoopRecord& record = state.loops[k];
    return record.modes[record.mode].confidence;
  };
  const auto each = [&](std::size_t k, const auto& call) {
    const LoopRecord& record = state.loops[k];
    const auto list = state.relations.find(record.key(record.mode));
    if (list == state.relations.end()) return;
    for (const Relation& relation : list->second) {
      const auto other = place.find(relation.other);
      if (other == place.end()) continue;
      if (relation.agrees_from <= scale)
        call(other->second, true);
      else if (scale < relation.contradicts_below)
        call(other->second, false);
    }
  };
  for (const auto& [key, k] : place)
    each(k, [&, me = k](std::size_t other, bool agrees) {
      balance[me] += agrees ? -confidence(other) : confidence(other);
      against[me] += agrees ? 0 : 1;
    });
  for (;;) {
    std::size_t worst = count;
    for (std::size_t k = 0; k < count; ++k) {
      if (!fits[k] || out[k] || against[k] == 0) continue;
      if (worst == count || balance[k] - confidence(k) > balance[worst] - confidence(worst))
        worst = k;
    }
    if (worst == count) return out;
    out[worst] = 1;
    each(worst, [&](std::size_t other, bool agrees) {
      balance[other] -= agrees ? -confidence(worst) : confidence(worst);
      against[other] -= agrees ? 0 : 1;
    });
  }
}

}  // namespace gpureg::loop_closure
