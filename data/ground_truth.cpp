// SPDX-License-Identifier: BSD-3-Clause
#include "data/ground_truth.hpp"

#include <algorithm>
#include <cstdio>

#include "gpureg/evaluation.hpp"
#include "gpureg/files.hpp"

namespace gpureg::synthetic {
namespace {

using Eigen::Vector3f;
using Eigen::Vector3i;

/// Sum of A'A over points, A = [I | -2 [p]x] with the quaternion vector's factor 2
/// (redwood-data.org; Choi et al. 2015).
class Information {
 public:
  void add(const Vector3f& point) {
    const Eigen::Vector3d p = point.cast<double>();
    ++count_;
    sum_ += p;
    products_ += p * p.transpose();
  }

  Eigen::Matrix<double, 6, 6> matrix() const {
    Eigen::Matrix3d cross;  // of the sum: rows (0, z, -y), (-z, 0, x), (y, -x, 0)
    cross << 0, sum_.z(), -sum_.y(), -sum_.z(), 0, sum_.x(), sum_.y(), -sum_.x(), 0;
    Eigen::Matrix<double, 6, 6> m = Eigen::Matrix<double, 6, 6>::Zero();
    m.topLeftCorner<3, 3>() = static_cast<double>(count_) * Eigen::Matrix3d::Identity();
    m.topRightCorner<3, 3>() = 2 * cross;
    m.bottomLeftCorner<3, 3>() = 2 * cross.transpose();
    m.bottomRightCorner<3, 3>() = 4 * (products_.trace() * Eigen::Matrix3d::Identity() - products_);
    return m;
  }

 private:
  long count_ = 0;
  Eigen::Vector3d sum_ = Eigen::Vector3d::Zero();
  Eigen::Matrix3d products_ = Eigen::Matrix3d::Zero();
};

}  // namespace

NeighbourGrid::NeighbourGrid(const std::vector<Vector3f>& points, float radius)
    : radius_(radius),
      inverse_cell_(1.0f / radius),
      low_(Vector3f::Zero()),
      size_(Vector3i::Ones()) {
  if (!points.empty()) {
    Vector3f high = points.front();
    low_ = high;
    for (const Vector3f& p : points) {
      low_ = low_.cwiseMin(p);
      high = high.cwiseMax(p);
    }
    low_.array() -=
        2.5f * radius;  // an empty border: a query with a neighbour has all its 27 cells inside
    size_ = ((high - low_) * inverse_cell_).array().floor().cast<int>() + 4;
  }
  const auto cell_of = [&](const Vector3f& p) {
    const Vector3i c = ((p - low_) * inverse_cell_).array().floor().cast<int>();
    return (static_cast<std::size_t>(c.z()) * static_cast<std::size_t>(size_.y()) +
            static_cast<std::size_t>(c.y())) *
               static_cast<std::size_t>(size_.x()) +
           static_cast<std::size_t>(c.x());
  };
  start_.assign(static_cast<std::size_t>(size_.x()) * static_cast<std::size_t>(size_.y()) *
                        static_cast<std::size_t>(size_.z()) +
                    1,
                0);
  for (const Vector3f& p : points) ++start_[cell_of(p) + 1];
  for (std::size_t c = 1; c < start_.size(); ++c) start_[c] += start_[c - 1];
  points_.resize(points.size());
  std::vector<std::uint32_t> next(start_.begin(), start_.end() - 1);
  for (const Vector3f& p : points) points_[next[cell_of(p)]++] = p;
}

bool NeighbourGrid::any_within_radius(const Vector3f& query) const {
  const Vector3f relative = (query - low_) * inverse_cell_;
  if ((relative.array() < 1.0f).any() ||
      (relative.array() >= size_.cast<float>().array() - 1.0f).any())
    return false;
  const Vector3i c = relative.array().floor().cast<int>();
  const float limit = radius_ * radius_;
  constexpr int kOrder[3] = {0, -1, 1};  // the query's own row first: most queries end there
  for (const int dz : kOrder) {
    for (const int dy : kOrder) {
      const std::size_t row =
          (static_cast<std::size_t>(c.z() + dz) * static_cast<std::size_t>(size_.y()) +
           static_cast<std::size_t>(c.y() + dy)) *
          static_cast<std::size_t>(size_.x());
      const std::size_t first = row + static_cast<std::size_t>(c.x() - 1);
      for (std::uint32_t k = start_[first]; k < start_[first + 3]; ++k) {
        if ((points_[k] - query).squaredNorm() <= limit) return true;
      }
    }
  }
  return false;
}

PairTruth pair_truth(const std::vector<Fragment>& fragments,
                     const std::vector<NeighbourGrid>& grids, int i, int j) {
  const auto a = static_cast<std::size_t>(i), b = static_cast<std::size_t>(j);
  PairTruth truth;
  truth.i = i;
  truth.j = j;
  const Eigen::Isometry3d i_from_j =
      fragments[a].world_from_fragment.inverse() * fragments[b].world_from_fragment;
  truth.i_from_j = i_from_j.matrix();
  const Eigen::Isometry3f forward = i_from_j.cast<float>(),
                          backward = i_from_j.inverse().cast<float>();
  Information information;
  std::size_t of_i = 0, of_j = 0;
  for (const Vector3f& p : fragments[b].points) {
    if (!grids[a].any_within_radius(forward * p)) continue;
    ++of_j;
    information.add(p);
  }
  if (of_j > 0) {  // a neighbour is mutual
    for (const Vector3f& p : fragments[a].points)
      of_i += grids[b].any_within_radius(backward * p) ? 1 : 0;
  }
  truth.share_of_i = static_cast<double>(of_i) /
                     static_cast<double>(std::max<std::size_t>(1, fragments[a].points.size()));
  truth.share_of_j = static_cast<double>(of_j) /
                     static_cast<double>(std::max<std::size_t>(1, fragments[b].points.size()));
  truth.information = information.matrix();
  return truth;
}

void write_ground_truth(const std::string& folder, int fragments,
                        const std::vector<PairTruth>& truths) {
  std::vector<evaluation::LogEntry> log, all_log;
  std::vector<evaluation::InformationEntry> information, all_information;
  std::string overlap;
  char line[96];
  for (const PairTruth& t : truths) {
    std::snprintf(line, sizeof(line), "%d %d %.4f %.4f\n", t.i, t.j, t.overlap(),
                  std::min(t.share_of_i, t.share_of_j));
    overlap += line;
    if (t.overlap() < kAnyOverlap) continue;
    all_log.push_back({t.i, t.j, fragments, t.i_from_j});
    all_information.push_back({t.i, t.j, fragments, t.information});
    if (t.overlap() < kGroundTruthOverlap) continue;
    log.push_back(all_log.back());
    information.push_back(all_information.back());
  }
  files::write_atomically(folder + "/gt_overlap.txt", overlap);
  evaluation::write_information(folder + "/gt_all.info", all_information);
  evaluation::write_log(folder + "/gt_all.log", all_log);
  evaluation::write_information(folder + "/gt.info", information);
  evaluation::write_log(folder + "/gt.log", log);
}

}  // namespace gpureg::synthetic
