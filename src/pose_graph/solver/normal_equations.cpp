// SPDX-License-Identifier: BSD-3-Clause
#include "pose_graph/solver/normal_equations.hpp"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <numeric>

#include "math/trigonometry.hpp"
#include "pose_graph/parallel.hpp"

namespace gpureg::pose_graph {
namespace {

/// The structure is computed again when fewer than this share of its edges still have a weight: a
/// sparser factor then pays for the new order.
constexpr double kStaleShare = 0.8;
/// Diagonal entries count as at least this much in the damping (1/rad^2 or 1/m^2), so that a node
/// whose edges all lost their weight keeps its pose.
constexpr double kMinDiagonal = 1e-6;

/// Sums in blocks of a fixed size, so that the number of threads does not matter.
template <typename Term>
double blocked_sum(int count, int threads, const Term& term) {
  constexpr int kBlockSize = 256;
  const int blocks = (count + kBlockSize - 1) / kBlockSize;
  std::vector<double> sums(blocks, 0.0);
  for_ranges(count, threads, [&](int begin, int end) {
    // A block belongs to the range in which it begins.
    for (int b = (begin + kBlockSize - 1) / kBlockSize; b * kBlockSize < end; ++b)
      for (int k = b * kBlockSize; k < std::min(count, (b + 1) * kBlockSize); ++k)
        sums[b] += term(k);
  });
  return std::accumulate(sums.begin(), sums.end(), 0.0);
}

/// SplitMix64 (Steele et al. 2014) of a counter: a number in (0, 1).
double uniform(std::uint64_t counter) {
  std::uint64_t z = (counter + 1) * 0x9E3779B97F4A7C15u;
  z = (z ^ (z >> 30)) * 0xBF58476D1CE4E5B9u;
  z = (z ^ (z >> 27)) * 0x94D049BB133111EBu;
  z ^= z >> 31;
  return (static_cast<double>(z >> 11) + 0.5) / 9007199254740992.0;
}

/// Box and Muller 1958.
double standard_normal(int number, int index) {
  const std::uint64_t counter = (std::uint64_t(number) << 40) + 2 * std::uint64_t(index);
  constexpr double two_pi = 6.283185307179586;
  return std::sqrt(-2 * portable::log(uniform(counter))) *
         portable::cos(two_pi * uniform(counter + 1));
}

const ModeTerm& chosen(const Problem& problem, const Selection& selection, int edge) {
  return problem.modes[problem.edges[edge].first_mode + selection.modes[edge]];
}

}  // namespace

EdgeLinearisation linearise_edge(const Pose& source, const Pose& target, const ModeTerm& mode) {
  const Pose target_from_source = target.inverse() * source;
  EdgeLinearisation out;
  out.residual = log(mode.inverse * target_from_source);
  out.source = right_jacobian_inverse(out.residual);
  out.target = -out.source * adjoint(target_from_source.inverse());
  return out;
}

GravityLinearisation linearise_gravity(const Pose& node, const GravityTerm& term) {
  return {node.rotation * term.up - Eigen::Vector3d::UnitZ(), -node.rotation * skew(term.up)};
}

double weighted_cost(const Problem& problem, const std::vector<Pose>& poses,
                     const Selection& selection, int threads) {
  double sum = blocked_sum(problem.edge_count(), threads, [&](int k) {
    const double weight = selection.weights[k];
    if (weight == 0) return 0.0;
    const EdgeTerm& edge = problem.edges[k];
    return weight *
           squared_error(poses[edge.source], poses[edge.target], chosen(problem, selection, k));
  });
  for (const GravityTerm& term : problem.gravity)
    sum += term.weight * linearise_gravity(poses[term.node], term).residual.squaredNorm();
  for (const PriorTerm& term : problem.priors) {
    const Vector6d e = log(term.inverse * poses[term.node]);
    sum += e.dot(term.information * e);
  }
  return 0.5 * sum;
}

NormalEquations::NormalEquations(const Problem& problem, int threads)
    : problem_(problem), threads_(threads) {
  for (const char held : problem.held) column_.push_back(held ? -1 : columns_++);
  matrix_.diagonal.resize(columns_);
  gradient_.resize(columns_);
  contributions_.resize(problem.edges.size());
}

bool NormalEquations::structure_fits(const Selection& selection) const {
  if (!cholesky_) return false;
  int active = 0;
  for (int k = 0; k < problem_.edge_count(); ++k) {
    if (selection.weights[k] == 0) continue;
    const EdgeTerm& edge = problem_.edges[k];
    if (column_[edge.source] < 0 || column_[edge.target] < 0) continue;
    if (block_of_[k] < 0) return false;
    ++active;
  }
  return active >= kStaleShare * active_edges_;
}

void NormalEquations::build_structure(const Selection& selection) {
  matrix_.pattern.clear();
  const auto entry = [&](int k) {
    const int a = column_[problem_.edges[k].source], b = column_[problem_.edges[k].target];
    return std::make_pair(std::min(a, b), std::max(a, b));
  };
  active_edges_ = 0;
  for (int k = 0; k < problem_.edge_count(); ++k)
    if (selection.weights[k] != 0 && entry(k).first >= 0) {
      matrix_.pattern.push_back(entry(k));
      ++active_edges_;
    }
  std::sort(matrix_.pattern.begin(), matrix_.pattern.end());
  matrix_.pattern.erase(std::unique(matrix_.pattern.begin(), matrix_.pattern.end()),
                        matrix_.pattern.end());
  // Edges of pairs that are in the pattern anyway have a block, too: they may get a weight later.
  block_of_.assign(problem_.edges.size(), -1);
  for (int k = 0; k < problem_.edge_count(); ++k) {
    if (entry(k).first < 0) continue;
    const auto at = std::lower_bound(matrix_.pattern.begin(), matrix_.pattern.end(), entry(k));
    if (at != matrix_.pattern.end() && *at == entry(k))
      block_of_[k] = static_cast<int>(at - matrix_.pattern.begin());
  }
  matrix_.blocks.resize(matrix_.pattern.size());
  cholesky_ = std::make_unique<BlockCholesky>(columns_, matrix_.pattern, threads_);
}

void NormalEquations::linearise(const std::vector<Pose>& poses, const Selection& selection) {
  if (!structure_fits(selection)) build_structure(selection);
  for_ranges(problem_.edge_count(), threads_, [&](int begin, int end) {
    for (int k = begin; k < end; ++k) {
      if (selection.weights[k] == 0) continue;
      const EdgeTerm& edge = problem_.edges[k];
      const ModeTerm& mode = chosen(problem_, selection, k);
      const EdgeLinearisation line = linearise_edge(poses[edge.source], poses[edge.target], mode);
      const Matrix6d weighted = selection.weights[k] * mode.information;
      const Matrix6d source = line.source.transpose() * weighted;
      const Matrix6d target = line.target.transpose() * weighted;
      Contribution& out = contributions_[k];
      out.source.noalias() = source * line.source;
      out.target.noalias() = target * line.target;
      if (column_[edge.source] > column_[edge.target])
        out.cross.noalias() = source * line.target;
      else
        out.cross.noalias() = target * line.source;
      out.source_gradient.noalias() = source * line.residual;
      out.target_gradient.noalias() = target * line.residual;
    }
  });
  for (Matrix6d& block : matrix_.diagonal) block.setZero();
  for (Matrix6d& block : matrix_.blocks) block.setZero();
  for (Vector6d& g : gradient_) g.setZero();
  for (int k = 0; k < problem_.edge_count(); ++k) {
    if (selection.weights[k] == 0) continue;
    const int source = column_[problem_.edges[k].source];
    const int target = column_[problem_.edges[k].target];
    const Contribution& part = contributions_[k];
    if (source >= 0) {
      matrix_.diagonal[source] += part.source;
      gradient_[source] += part.source_gradient;
    }
    if (target >= 0) {
      matrix_.diagonal[target] += part.target;
      gradient_[target] += part.target_gradient;
    }
    if (source >= 0 && target >= 0) matrix_.blocks[block_of_[k]] += part.cross;
  }
  for (const GravityTerm& term : problem_.gravity) {
    const int column = column_[term.node];
    if (column < 0) continue;
    const GravityLinearisation line = linearise_gravity(poses[term.node], term);
    matrix_.diagonal[column].topLeftCorner<3, 3>() +=
        term.weight * line.rotation.transpose() * line.rotation;
    gradient_[column].head<3>() += term.weight * line.rotation.transpose() * line.residual;
  }
  for (const PriorTerm& term : problem_.priors) {
    const int column = column_[term.node];
    if (column < 0) continue;
    const Vector6d e = log(term.inverse * poses[term.node]);
    const Matrix6d j = right_jacobian_inverse(e);
    matrix_.diagonal[column] += j.transpose() * term.information * j;
    gradient_[column] += j.transpose() * (term.information * e);
  }
}

Vector6d NormalEquations::scale(int column) const {
  return matrix_.diagonal[column].diagonal().cwiseMax(kMinDiagonal);
}

bool NormalEquations::solve(double damping, std::vector<Vector6d>& step) {
  damped_ = matrix_;
  for (int c = 0; c < columns_; ++c) damped_.diagonal[c].diagonal() += damping * scale(c);
  if (!cholesky_->factorise(damped_)) return false;
  std::vector<Vector6d> x(columns_);
  for (int c = 0; c < columns_; ++c) x[c] = -gradient_[c];
  cholesky_->solve(x);
  step.assign(problem_.ids.size(), Vector6d::Zero());
  bool finite = true;
  for (std::size_t node = 0; node < step.size(); ++node)
    if (column_[node] >= 0) {
      step[node] = x[column_[node]];
      finite = finite && step[node].allFinite();
    }
  return finite;
}

double NormalEquations::expected_decrease(double damping, const std::vector<Vector6d>& step) const {
  // With (H + damping D) s = -g: -g's - s'Hs / 2 = (damping s'Ds - g's) / 2.
  double sum = 0;
  for (std::size_t node = 0; node < step.size(); ++node) {
    const int c = column_[node];
    if (c < 0) continue;
    sum += damping * step[node].cwiseAbs2().dot(scale(c)) - gradient_[c].dot(step[node]);
  }
  return 0.5 * sum;
}

Matrix6d NormalEquations::marginal(int node) const {
  Matrix6d covariance;
  std::vector<Vector6d> x(columns_);
  for (int k = 0; k < 6; ++k) {
    for (Vector6d& v : x) v.setZero();
    x[column_[node]][k] = 1;
    cholesky_->solve(x);
    covariance.col(k) = x[column_[node]];
  }
  return 0.5 * (covariance + covariance.transpose());
}

std::vector<Vector6d> NormalEquations::sample(int number) const {
  std::vector<Vector6d> x(columns_);
  for (int c = 0; c < columns_; ++c)
    for (int i = 0; i < 6; ++i) x[c][i] = standard_normal(number, 6 * c + i);
  cholesky_->colour(x);
  std::vector<Vector6d> out(problem_.ids.size(), Vector6d::Zero());
  for (std::size_t node = 0; node < out.size(); ++node)
    if (column_[node] >= 0) out[node] = x[column_[node]];
  return out;
}

}  // namespace gpureg::pose_graph
