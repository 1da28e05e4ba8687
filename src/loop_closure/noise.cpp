// SPDX-License-Identifier: BSD-3-Clause
#include "loop_closure/noise.hpp"

#include <Eigen/Cholesky>
#include <algorithm>
#include <array>
#include <cmath>

#include "loop_closure/accept.hpp"
#include "math/exponential.hpp"
#include "pose_graph/validate.hpp"

namespace gpureg::loop_closure {
namespace {

/// Loops that the estimate takes, evenly spread over all.
constexpr std::size_t kMostLoops = 256;
/// Rounds of the maximisation at most, and the relative change of the variances that ends it.
constexpr int kMostNoiseRounds = 50;
constexpr double kConverged = 0.01;
/// The stated noise is right within this factor, by one standard deviation of its logarithm.
/// Results hardly depend on it (bench/notes/loops.md).
constexpr double kStatedWithin = 4;
/// Odometry is thought to be better by this factor at most, and worse by that: e^6, e^2.5, as
/// logarithms of variances. Loops are never worse than stated: what odometry does not explain is
/// its own.
constexpr double kLeastLog = -12, kMostLogOfOdometry = 5, kMostLogOfLoops = 0;
/// Halvings of that range.
constexpr int kHalvings = 40;

/// See estimate_noise(). bench/notes/loops.md: 1 adds a fifth or more to the error of a wrong
/// scale, 3 a tenth to that of independent noise.
constexpr double kTranslationBehind = 2;
/// Half of what pose graphs take: rounding stays within.
constexpr double kMostInformation = 0.5 * pose_graph::kLargestInformation;

constexpr std::size_t kComponents = 4;  ///< in the order of NoiseScales

struct Misclosure {
  Vector6d error;
  std::array<Matrix6d, kComponents> parts;  ///< of its covariance
  Matrix6d fixed;                           ///< odometry of the host with covariance
};

std::vector<Misclosure> misclosures(const State& state, const Paths& odometry) {
  std::vector<const LoopRecord*> loops;
  for (const LoopRecord& record : state.loops)
    if (record.loop.state == LoopState::accepted &&
        odometry.component(odometry.position(record.source)) ==
            odometry.component(odometry.position(record.target)))
      loops.push_back(&record);
  std::vector<Misclosure> out;
  const std::size_t count = std::min(loops.size(), kMostLoops);
  for (std::size_t k = 0; k < count; ++k) {
    const LoopRecord& record = *loops[k * loops.size() / count];
    const UncertainPose loop = uncertain(record.modes[record.mode]);
    const PathTree tree = odometry.tree(odometry.position(record.target));
    const PathParts path = tree.parts(odometry.position(record.source));
    Misclosure m;
    m.error = pose_graph::log(loop.pose.inverse() * path.pose);
    m.fixed = path.fixed;
    const RotationShare share = rotation_share(loop.covariance);
    m.parts = {path.rotation, path.translation, share.rotation, share.translation};
    out.push_back(m);
  }
  return out;
}

/// The logarithm u of the factor on a stated variance at which expected * e^u + shown * e^-u +
/// (u / sigma)^2 is least: the bound that minorisation puts on the log likelihood, and the prior.
double most_likely_log(double expected, double shown, double most) {
  const double sigma = 2 * portable::log(kStatedWithin);
  double low = kLeastLog, high = most;
  for (int k = 0; k < kHalvings; ++k) {
    const double u = 0.5 * (low + high);
    const double slope =
        expected * portable::exp(u) - shown * portable::exp(-u) + 2 * u / (sigma * sigma);
    (slope < 0 ? low : high) = u;
  }
  return 0.5 * (low + high);
}

/// Factors on the stated variances that make the misclosures most likely.
std::array<double, kComponents> most_likely(const std::vector<Misclosure>& data) {
  std::array<double, kComponents> factors{1, 1, 1, 1};
  for (int round = 0; round < kMostNoiseRounds; ++round) {
    std::array<double, kComponents> shown{}, expected{};
    for (const Misclosure& m : data) {
      Matrix6d covariance = m.fixed;
      for (std::size_t c = 0; c < kComponents; ++c) covariance += factors[c] * m.parts[c];
      const Eigen::LLT<Matrix6d> factor(covariance);
      const Matrix6d information = factor.solve(Matrix6d::Identity());
      // Covariances too different in size to be added say nothing.
      if (factor.info() != Eigen::Success || !information.allFinite()) continue;
      const Vector6d weighted = information * m.error;
      for (std::size_t c = 0; c < kComponents; ++c) {
        shown[c] += weighted.dot(m.parts[c] * weighted);
        expected[c] += information.cwiseProduct(m.parts[c]).sum();
      }
    }
    double change = 0;
    for (std::size_t c = 0; c < kComponents; ++c) {
      if (!std::isfinite(expected[c]) || !std::isfinite(shown[c])) continue;
      const double next =
          portable::exp(most_likely_log(expected[c], shown[c] * portable::square(factors[c]),
                                        c < 2 ? kMostLogOfOdometry : kMostLogOfLoops));
      change = std::max(change, std::abs(next / factors[c] - 1));
      factors[c] = next;
    }
    if (change < kConverged) break;
  }
  return factors;
}

}  // namespace

NoiseScales estimate_noise(const State& state, const Paths& odometry, double drift_scale) {
  std::vector<Misclosure> data = misclosures(state, odometry);
  for (Misclosure& m : data)
    for (std::size_t c = 0; c < 2; ++c) m.parts[c] *= portable::square(drift_scale);
  const std::array<double, kComponents> factors = most_likely(data);
  NoiseScales out{drift_scale * std::sqrt(factors[0]), drift_scale * std::sqrt(factors[1]),
                  std::sqrt(factors[2]), std::sqrt(factors[3])};
  // A wrong scale of the translation cancels along closed paths, and loops show it last: below the
  // stated noise, no more than half of what they say of the rotation is believed of it.
  out.translation = std::max(
      {out.translation, out.rotation, std::min(drift_scale, kTranslationBehind * out.rotation)});
  return out;
}

UnalignedMatrix6d scaled_information(const UnalignedMatrix6d& information, double rotation,
                                     double translation, double weight) {
  const RotationShare share = rotation_share(pose_graph::covariance_of(information));
  const Matrix6d covariance = portable::square(rotation) * share.rotation +
                              portable::square(translation) * share.translation;
  const Eigen::LLT<Matrix6d> factor(covariance);
  const Matrix6d inverse = weight * factor.solve(Matrix6d::Identity());
  const double largest = inverse.cwiseAbs().maxCoeff();
  // Numbers too different in size for this stay as they are.
  if (factor.info() != Eigen::Success || !inverse.allFinite())
    return std::min(weight, 1.0) * information;
  const double most = std::min(1.0, kMostInformation / largest);
  return UnalignedMatrix6d(0.5 * most * (inverse + inverse.transpose()));
}

}  // namespace gpureg::loop_closure
