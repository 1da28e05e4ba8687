// SPDX-License-Identifier: BSD-3-Clause
#include "sequence.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <fstream>
#include <random>
#include <stdexcept>
#include <utility>

namespace gpureg::bench {
namespace {

/// A registered pose is correct within this, as in the other benchmarks.
constexpr double kMetres = 0.35, kDegrees = 8;
/// Fragments between the ends of a loop: nearer ones are connected by tracking.
constexpr int kLeastGap = 2;
/// Fragments after which a pair that overlaps is a revisit.
constexpr int kRevisitGap = 8;
constexpr double kRevisitOverlap = 0.3;
/// Draws of odometry's errors, of which the one of median size is taken: where bias and noise
/// happen to cancel at the revisit, the size would be many times larger.
constexpr int kDraws = 7;

double angle(const UnalignedIsometry3d& pose) {
  return Eigen::AngleAxisd(pose.linear()).angle() * 180 / M_PI;
}

UnalignedIsometry3d read_pose(std::istream& file) {
  UnalignedIsometry3d pose = UnalignedIsometry3d::Identity();
  for (int row = 0; row < 3; ++row)
    for (int column = 0; column < 4; ++column) file >> pose.matrix()(row, column);
  return pose;
}

UnalignedIsometry3d truth_of(const Sequence& s, int source, int target) {
  return s.truth[static_cast<std::size_t>(target)].inverse() *
         s.truth[static_cast<std::size_t>(source)];
}

}  // namespace

bool correct(const UnalignedIsometry3d& truth, const UnalignedIsometry3d& pose) {
  const UnalignedIsometry3d error = truth.inverse() * pose;
  return error.translation().norm() <= kMetres && angle(error) <= kDegrees;
}

Sequence read_sequence(const std::string& path) {
  std::ifstream file(path);
  std::size_t fragments = 0, pairs = 0;
  file >> fragments >> pairs;
  Sequence out;
  for (std::size_t k = 0; k < fragments; ++k) out.truth.push_back(read_pose(file));
  for (std::size_t k = 0; k < pairs && file; ++k) {
    RegisteredPair pair;
    std::size_t modes = 0;
    CorrespondenceMoments& moments = pair.result.source_moments;
    file >> pair.source >> pair.target >> pair.overlap >> moments.count;
    for (int c = 0; c < 3; ++c) file >> moments.sum[c];
    for (int c = 0; c < 9; ++c) file >> moments.outer.data()[c];
    file >> modes;
    for (std::size_t m = 0; m < modes; ++m) {
      RegistrationMode mode;
      file >> mode.confidence;
      mode.target_from_source = read_pose(file);
      for (double& v : mode.evidence.information_eigenvalues) file >> v;
      for (double& v : mode.evidence.weakest_direction) file >> v;
      pair.result.modes.push_back(mode);
    }
    if (modes > 0) {
      pair.result.target_from_source = pair.result.modes[0].target_from_source;
      pair.result.confidence = pair.result.modes[0].confidence;
    }
    out.pairs.push_back(pair);
  }
  if (!file) throw std::runtime_error(path + " cannot be read");
  int best = static_cast<int>(fragments);
  for (const RegisteredPair& pair : out.pairs) {
    const int late = std::max(pair.source, pair.target), early = std::min(pair.source, pair.target);
    if (late - early < kRevisitGap || pair.overlap < kRevisitOverlap || late >= best ||
        pair.result.modes.empty() || pair.result.confidence < 0.5 ||
        !correct(truth_of(out, pair.source, pair.target), pair.result.target_from_source))
      continue;
    best = late;
    out.revisit_source = late;
    out.revisit_target = early;
  }
  return out;
}

namespace {

/// One draw of the errors of odometry.
class Drift {
 public:
  Drift(const Sequence& sequence, std::mt19937_64& random) : sequence_(sequence) {
    std::normal_distribution<double> normal;
    yaw_bias_ = normal(random) > 0 ? 1 : -1;
    scale_bias_ = 0.5 * normal(random);
    noise_.resize(sequence.truth.size());
    for (auto& v : noise_)
      for (int k = 0; k < 6; ++k) v[k] = normal(random);
  }

  /// @param size metres of error per metre; degrees of yaw per metre are ten times as many, as in
  ///   DriftOptions.
  std::vector<UnalignedIsometry3d> poses(double size) const {
    const std::vector<UnalignedIsometry3d>& truth = sequence_.truth;
    std::vector<UnalignedIsometry3d> out{truth[0]};
    for (std::size_t k = 1; k < truth.size(); ++k) {
      UnalignedIsometry3d step = truth[k - 1].inverse() * truth[k];
      const double length = std::max(0.05, step.translation().norm());
      step.translation() *= 1 + size * scale_bias_;
      const Eigen::Vector3d turn =
          10 * size * length * M_PI / 180 *
          (yaw_bias_ * (truth[k].linear().transpose() * Eigen::Vector3d::UnitZ()) +
           0.5 * noise_[k].head<3>());
      UnalignedIsometry3d error = UnalignedIsometry3d::Identity();
      if (turn.norm() > 0)
        error.linear() = Eigen::AngleAxisd(turn.norm(), turn.normalized()).toRotationMatrix();
      error.translation() = 0.5 * size * length * noise_[k].tail<3>();
      out.push_back(out.back() * step * error);
    }
    return out;
  }

  /// The size at which the first revisit is off by `metres`.
  double size(double metres) const {
    double low = 0, high = 1e-3;
    while (misclosure(high) < metres && high < 1) high *= 1.3;
    for (int k = 0; k < 60; ++k) {
      const double middle = 0.5 * (low + high);
      (misclosure(middle) < metres ? low : high) = middle;
    }
    return high;
  }

 private:
  double misclosure(double size) const {
    const std::vector<UnalignedIsometry3d> odometry = poses(size);
    const auto s = static_cast<std::size_t>(sequence_.revisit_source);
    const auto t = static_cast<std::size_t>(sequence_.revisit_target);
    return ((odometry[t].inverse() * odometry[s]).translation() -
            (sequence_.truth[t].inverse() * sequence_.truth[s]).translation())
        .norm();
  }

  const Sequence& sequence_;
  double yaw_bias_ = 1, scale_bias_ = 0;
  std::vector<Eigen::Matrix<double, 6, 1>> noise_;
};

}  // namespace

SimulatedOdometry drifted(const Sequence& sequence, double metres, std::uint64_t seed) {
  std::mt19937_64 random(seed);
  std::vector<std::pair<double, std::vector<UnalignedIsometry3d>>> draws;
  for (int k = 0; k < kDraws; ++k) {
    const Drift drift(sequence, random);
    const double size = drift.size(metres);
    draws.emplace_back(size, drift.poses(size));
  }
  std::sort(draws.begin(), draws.end(),
            [](const auto& a, const auto& b) { return a.first < b.first; });
  const auto& [size, poses] = draws[kDraws / 2];
  return {poses, size};
}

std::vector<UnalignedIsometry3d> noisy(const Sequence& sequence, double share, double degrees,
                                       std::uint64_t seed) {
  std::mt19937_64 random(seed);
  std::normal_distribution<double> normal(0, 1 / std::sqrt(3.0));  // of each axis
  const auto draw = [&] {
    const double x = normal(random), y = normal(random), z = normal(random);
    return Eigen::Vector3d(x, y, z);
  };
  std::vector<UnalignedIsometry3d> out{sequence.truth[0]};
  for (std::size_t k = 1; k < sequence.truth.size(); ++k) {
    const UnalignedIsometry3d step = sequence.truth[k - 1].inverse() * sequence.truth[k];
    const Eigen::Vector3d turn = degrees * M_PI / 180 * draw();
    UnalignedIsometry3d error = UnalignedIsometry3d::Identity();
    error.linear() = Eigen::AngleAxisd(turn.norm(), turn.stableNormalized()).toRotationMatrix();
    error.translation() = share * step.translation().norm() * draw();
    out.push_back(out.back() * step * error);
  }
  return out;
}

std::vector<Trial> trials(const Sequence& sequence, std::size_t most, double false_share,
                          bool shuffled, std::uint64_t seed) {
  std::mt19937_64 random(seed);
  std::vector<Trial> good, wrong;
  for (const RegisteredPair& pair : sequence.pairs) {
    if (std::abs(pair.source - pair.target) < kLeastGap) continue;
    for (std::size_t m = 0; m < pair.result.modes.size(); ++m) {
      Trial trial;
      trial.source = pair.source;
      trial.target = pair.target;
      trial.overlap = pair.overlap;
      trial.result = pair.result;
      trial.result.modes = {pair.result.modes[m]};
      trial.result.target_from_source = trial.result.modes[0].target_from_source;
      trial.result.confidence = trial.result.modes[0].confidence;
      trial.is_true =
          correct(truth_of(sequence, pair.source, pair.target), trial.result.target_from_source);
      if (m == 0 && trial.is_true && trial.result.confidence >= 0.5) good.push_back(trial);
      if (m == 0 && !trial.is_true) wrong.push_back(trial);
    }
  }
  std::shuffle(good.begin(), good.end(), random);
  std::shuffle(wrong.begin(), wrong.end(), random);
  if (good.size() > most) good.resize(most);
  const auto count = static_cast<std::size_t>(
      std::llround(false_share / (1 - false_share) * static_cast<double>(good.size())));
  if (count > wrong.size()) return {};
  // The most confident wrong poses are the hard ones.
  std::stable_sort(wrong.begin(), wrong.end(), [](const Trial& a, const Trial& b) {
    return a.result.confidence > b.result.confidence;
  });
  wrong.resize(count);
  std::vector<Trial> out = good;
  for (Trial& trial : wrong) {
    if (shuffled) {
      const double confidence = good[random() % good.size()].result.confidence;
      trial.result.confidence = trial.result.modes[0].confidence = confidence;
    }
    out.push_back(trial);
  }
  std::shuffle(out.begin(), out.end(), random);
  return out;
}

double rmse(const std::vector<UnalignedIsometry3d>& truth,
            const std::vector<UnalignedIsometry3d>& poses) {
  const auto count = static_cast<Eigen::Index>(truth.size());
  Eigen::Matrix3Xd from(3, count), to(3, count);
  for (Eigen::Index k = 0; k < count; ++k) {
    from.col(k) = poses[static_cast<std::size_t>(k)].translation();
    to.col(k) = truth[static_cast<std::size_t>(k)].translation();
  }
  const Eigen::Matrix4d align = Eigen::umeyama(from, to, false);
  const Eigen::Matrix3Xd moved = (align.topLeftCorner<3, 3>() * from).colwise() +
                                 Eigen::Vector3d(align.topRightCorner<3, 1>());
  return std::sqrt((moved - to).colwise().squaredNorm().mean());
}

}  // namespace gpureg::bench
