// SPDX-License-Identifier: BSD-3-Clause
#include "scale/refine.hpp"

#include <cmath>
#include <limits>

namespace gpureg::scale {
namespace {

constexpr int kIterations = 16;
/// The kernel of the weights starts that much wider, and narrows by this factor per iteration.
constexpr double kWide = 4, kNarrow = 0.8;
/// Largest distance of a correspondence, in widths of the kernel.
constexpr double kIcpReach = 3;
constexpr std::size_t kLeastMatches = 40;
/// While the kernel is wide, so many points are one.
constexpr int kStride = 4;
constexpr double kStepSettled = 1e-4;  ///< change of the logarithm of the scale
/// Cosine of the largest angle between the normals of a correspondence.
constexpr double kLeastCosine = 0.8;

using Matrix7 = Eigen::Matrix<double, 7, 7>;
using Vector7 = Eigen::Matrix<double, 7, 1>;

std::uint64_t key_of(std::int64_t x, std::int64_t y, std::int64_t z) {
  constexpr std::int64_t kMiddle = std::int64_t(1) << 20;
  const auto part = [](std::int64_t c) {
    return static_cast<std::uint64_t>(c + kMiddle) & ((std::uint64_t(1) << 21) - 1);
  };
  return part(x) << 42 | part(y) << 21 | part(z);
}

/// Solves A x = b of a symmetric positive definite matrix by L D L'; false where it is none.
bool solve(const Matrix7& a, const Vector7& b, Vector7& x) {
  double l[7][7], d[7];
  for (int i = 0; i < 7; ++i) {
    for (int j = 0; j <= i; ++j) {
      double sum = a(i, j);
      for (int k = 0; k < j; ++k) sum -= l[i][k] * l[j][k] * d[k];
      if (j < i)
        l[i][j] = sum / d[j];
      else
        d[i] = sum;
    }
    if (!(d[i] > 1e-12 * a(i, i))) return false;
  }
  for (int i = 0; i < 7; ++i) {
    x[i] = b[i];
    for (int k = 0; k < i; ++k) x[i] -= l[i][k] * x[k];
  }
  for (int i = 6; i >= 0; --i) {
    x[i] /= d[i];
    for (int k = i + 1; k < 7; ++k) x[i] -= l[k][i] * x[k];
  }
  return true;
}

struct Equations {
  Matrix7 weighted = Matrix7::Zero(), information = Matrix7::Zero();
  Vector7 side = Vector7::Zero();
  std::size_t points = 0;
  double squares = 0, radius = 0;  ///< sums of squares: residuals, distances from the centre

  void add(const Eigen::Vector3d& arm, const Eigen::Vector3d& n, double residual, double width) {
    Vector7 j;
    const Eigen::Vector3d turn = arm.cross(n);
    j << turn, n, n.dot(arm);
    const double squared = residual * residual, k = width * width / (width * width + squared);
    const double weight = k * k;
    for (int c = 0; c < 7; ++c)
      for (int r = c; r < 7; ++r) {
        const double product = j[r] * j[c];
        weighted(r, c) += weight * product;
        information(r, c) += product;
      }
    for (int r = 0; r < 7; ++r) side[r] -= weight * residual * j[r];
    ++points;
    squares += squared;
    radius += arm.squaredNorm();
  }
  void fill() {
    for (int c = 0; c < 7; ++c)
      for (int r = 0; r < c; ++r) {
        weighted(r, c) = weighted(c, r);
        information(r, c) = information(c, r);
      }
  }
};

/// A point of each cloud. The normal is that of both (Rusinkiewicz 2019, A Symmetric Objective
/// Function for ICP): with that of one, and arms to the points of one, the scale of a pair and the
/// inverse of that of the swapped pair would differ.
struct Match {
  Eigen::Vector3d moved, normal, fixed;
  Eigen::Vector3d middle() const { return 0.5 * (moved + fixed); }
};

Eigen::Vector3d wide(Vec3 p) {
  return {static_cast<double>(p.x), static_cast<double>(p.y), static_cast<double>(p.z)};
}
Vec3 narrowed(const Eigen::Vector3d& p) {
  return {static_cast<float>(p.x()), static_cast<float>(p.y()), static_cast<float>(p.z())};
}

/// What is left of the information of the scale once the pose is free.
double scale_information(const Equations& e) {
  if (e.points < 8) return 0;
  // The last pivot of L D L' is the Schur complement of the last unknown.
  double l[7][7], d[7];
  for (int i = 0; i < 7; ++i) {
    for (int j = 0; j <= i; ++j) {
      double sum = e.information(i, j);
      for (int k = 0; k < j; ++k) sum -= l[i][k] * l[j][k] * d[k];
      if (j < i)
        l[i][j] = d[j] > 0 ? sum / d[j] : 0;
      else
        d[i] = sum > 1e-12 * e.information(i, i) ? sum : 0;
    }
  }
  return d[6];
}

}  // namespace

ClosestSurface::ClosestSurface(std::vector<Vec3> points, std::vector<Vec3> normals, float distance)
    : points_(std::move(points)),
      normals_(std::move(normals)),
      distance_(distance),
      inverse_(1 / distance) {
  for (std::size_t k = 0; k < points_.size(); ++k) {
    const Vec3 p = points_[k];
    cells_[key_of(static_cast<std::int64_t>(std::floor(p.x * inverse_)),
                  static_cast<std::int64_t>(std::floor(p.y * inverse_)),
                  static_cast<std::int64_t>(std::floor(p.z * inverse_)))]
        .push_back(static_cast<int>(k));
  }
}

int ClosestSurface::closest(Vec3 p, float distance) const {
  const float limit = 1e6f * distance_;
  if (!(std::abs(p.x) < limit && std::abs(p.y) < limit && std::abs(p.z) < limit)) return -1;
  const auto x = static_cast<std::int64_t>(std::floor(p.x * inverse_)),
             y = static_cast<std::int64_t>(std::floor(p.y * inverse_)),
             z = static_cast<std::int64_t>(std::floor(p.z * inverse_));
  float least = distance * distance;
  int best = -1;
  for (std::int64_t dx = -1; dx <= 1; ++dx)
    for (std::int64_t dy = -1; dy <= 1; ++dy)
      for (std::int64_t dz = -1; dz <= 1; ++dz) {
        const auto cell = cells_.find(key_of(x + dx, y + dy, z + dz));
        if (cell == cells_.end()) continue;
        for (const int k : cell->second) {
          const float squared = squared_norm(points_[static_cast<std::size_t>(k)] - p);
          if (squared < least || (squared == least && best >= 0 && k < best)) {
            least = squared;
            best = k;
          }
        }
      }
  return best;
}

RefinedScale refine_scale(const ClosestSurface& source, const ClosestSurface& target,
                          const UnalignedIsometry3d& target_from_source, float kernel) {
  RefinedScale out;
  Eigen::Matrix3d rotation = target_from_source.linear();
  Eigen::Vector3d shift = target_from_source.translation();
  double factor = 1;
  const double narrow = static_cast<double>(kernel);
  double width = kWide * narrow;
  for (int iteration = 0; iteration <= kIterations; ++iteration) {
    const int stride = width > narrow ? kStride : 1;
    const double reach = std::min(kIcpReach * width, static_cast<double>(target.distance()));
    std::vector<Match> matches;
    Eigen::Vector3d sum = Eigen::Vector3d::Zero();
    const auto add = [&](int of_source, int of_target) {
      const Eigen::Vector3d n = rotation * wide(source.normal(of_source)),
                            m = wide(target.normal(of_target));
      const double cosine = n.dot(m);
      if (!(std::abs(cosine) > kLeastCosine)) return;
      const Eigen::Vector3d both = cosine < 0 ? Eigen::Vector3d(m - n) : Eigen::Vector3d(m + n);
      matches.push_back({factor * (rotation * wide(source.point(of_source))) + shift,
                         both.normalized(), wide(target.point(of_target))});
      sum += matches.back().middle();
    };
    for (int k = 0; k < static_cast<int>(source.size()); k += stride) {
      const Eigen::Vector3d moved = factor * (rotation * wide(source.point(k))) + shift;
      const int found = target.closest(narrowed(moved), static_cast<float>(reach));
      if (found >= 0) add(k, found);
    }
    for (int k = 0; k < static_cast<int>(target.size()); k += stride) {
      const Eigen::Vector3d fixed = wide(target.point(k));
      const int found = source.closest(narrowed(rotation.transpose() * (fixed - shift) / factor),
                                       static_cast<float>(reach / factor));
      if (found >= 0) add(found, k);
    }
    if (matches.size() * static_cast<std::size_t>(stride) < kLeastMatches) return {};
    const Eigen::Vector3d centre = sum / static_cast<double>(matches.size());
    Equations e;
    for (const Match& m : matches)
      e.add(m.middle() - centre, m.normal, m.normal.dot(m.moved - m.fixed), width);
    e.fill();
    // What both clouds have was met from either side, and is one measurement.
    e.information *= 0.5;
    e.radius *= 0.5;
    out.factor = factor;
    out.information = e.information;
    out.points = e.points;
    out.rms = std::sqrt(e.squares / static_cast<double>(e.points));
    out.scale_information = scale_information(e);
    out.stiffness = e.radius > 0 ? std::sqrt(out.scale_information / e.radius) : 0;
    Vector7 step;
    if (iteration == kIterations || !solve(e.weighted, e.side, step)) return out;
    const Eigen::Vector3d turn = step.head<3>();
    const double grow = 1 + step[6];
    if (!(grow > 0.5 && grow < 2) || !(turn.norm() < 1)) return out;
    Eigen::Quaterniond small(1, 0.5 * turn.x(), 0.5 * turn.y(), 0.5 * turn.z());
    small.normalize();
    const Eigen::Matrix3d r = small.toRotationMatrix();
    // About the centre.
    shift = centre + step.segment<3>(3) + grow * (r * (shift - centre));
    rotation = r * rotation;
    factor *= grow;
    if (std::abs(step[6]) < kStepSettled && width == narrow) {
      out.factor = factor;
      return out;
    }
    width = std::max(narrow, kNarrow * width);
  }
  return out;
}

}  // namespace gpureg::scale
