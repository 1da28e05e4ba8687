// SPDX-License-Identifier: BSD-3-Clause
#include "localization/find/search_part.hpp"

#include <algorithm>
#include <cmath>

#include "algorithm/cell.hpp"

namespace gpureg::localization {
namespace {

/// Points of pieces that are prepared and aligned together.
constexpr std::size_t kPiecePointsAtOnce = 400'000;
/// Pieces with fewer points hold no part.
constexpr std::size_t kFewestPiecePoints = 20;

Vec3 vec3(const Eigen::Vector3f& p) { return {p.x(), p.y(), p.z()}; }

/// A piece with this share of its normals in one direction, within 14 degrees, is a bare plane: a
/// part that shows no more than that cannot be told from it.
constexpr double kPlane = 0.97;
constexpr float kSameDirection = 0.97f;

bool is_plane(const std::vector<Eigen::Vector3f>& normals, const std::vector<std::uint32_t>& rows) {
  Eigen::Vector3f mean = Eigen::Vector3f::Zero();
  const Eigen::Vector3f& first = normals[rows[rows.size() / 2]];
  for (const std::uint32_t k : rows) mean += normals[k].dot(first) < 0 ? -normals[k] : normals[k];
  mean.normalize();
  std::size_t same = 0;
  for (const std::uint32_t k : rows) same += std::abs(normals[k].dot(mean)) >= kSameDirection;
  return static_cast<double>(same) >= kPlane * static_cast<double>(rows.size());
}

/// Points by cells as wide as a radius.
class PieceCells {
 public:
  PieceCells(const std::vector<Eigen::Vector3f>& points, float radius)
      : points_(points), radius_(radius), inverse_(1 / radius) {
    for (std::uint32_t k = 0; k < points.size(); ++k)
      order_.emplace_back(cell_key(cell_of(vec3(points[k]), inverse_)), k);
    std::sort(order_.begin(), order_.end());
  }

  /// Calls visit(index) for each point within the radius.
  template <typename Visit>
  void within(const Eigen::Vector3f& middle, const Visit& visit) const {
    const Cell at = cell_of(vec3(middle), inverse_);
    for (std::int32_t z = at.z - 1; z <= at.z + 1; ++z)
      for (std::int32_t y = at.y - 1; y <= at.y + 1; ++y) {
        const Cell first{at.x - 1, y, z}, last{at.x + 1, y, z};
        if (!in_key_range(first) || !in_key_range(last)) continue;
        const std::uint64_t end = cell_key(last);
        for (auto k = std::lower_bound(order_.begin(), order_.end(),
                                       std::pair(cell_key(first), std::uint32_t{0}));
             k != order_.end() && k->first <= end; ++k)
          if ((points_[k->second] - middle).squaredNorm() <= radius_ * radius_) visit(k->second);
      }
  }

 private:
  const std::vector<Eigen::Vector3f>& points_;
  float radius_, inverse_;
  std::vector<std::pair<std::uint64_t, std::uint32_t>> order_;
};

}  // namespace

std::vector<std::uint32_t> middles_of_pieces(const std::vector<Eigen::Vector3f>& points,
                                             double distance) {
  const PieceCells cells(points, static_cast<float>(distance));
  std::vector<char> covered(points.size(), 0);
  std::vector<std::uint32_t> out;
  for (std::uint32_t k = 0; k < points.size(); ++k) {
    if (covered[k] != 0) continue;
    out.push_back(k);
    cells.within(points[k], [&](std::uint32_t near) { covered[near] = 1; });
  }
  return out;
}

std::vector<PartCandidate> search_pieces(const Context& context, const PreparedCloud& part,
                                         const SearchedScene& scene, const PieceSizes& sizes,
                                         const RegistrationSettings& options, std::size_t& pieces) {
  const PieceCells cells(scene.points, static_cast<float>(sizes.radius));
  std::vector<PointCloud> clouds;
  std::size_t points = 0;
  std::vector<PartCandidate> out;
  PrepareSettings prepare = options.prepare;
  prepare.voxel_size = 0;
  prepare.keep_range_limits = true;
  const auto align_those = [&] {
    std::vector<PointCloudView> views;
    for (const PointCloud& cloud : clouds) {
      views.push_back(cloud.view());
      views.back().infer_viewpoint = !cloud.viewpoints.empty();
    }
    std::vector<PreparedCloud> prepared = prepare_batch(context, views, prepare);
    std::vector<Pair> pairs;
    for (std::uint32_t k = 0; k < prepared.size(); ++k)
      pairs.push_back({static_cast<std::uint32_t>(prepared.size()), k});
    prepared.push_back(part);
    for (const RegistrationResult& result : align_batch(context, prepared, pairs, options))
      for (const RegistrationMode& mode : result.modes)
        out.push_back({mode.target_from_source, mode.confidence, 1});
    pieces += pairs.size();
    clouds.clear();
    points = 0;
  };
  for (const std::uint32_t middle : middles_of_pieces(scene.points, sizes.distance)) {
    PointCloud piece;
    piece.origin = scene.origin;
    piece.viewpoints = scene.viewpoints;
    std::vector<std::uint32_t> rows;
    cells.within(scene.points[middle], [&](std::uint32_t k) { rows.push_back(k); });
    if (rows.size() < kFewestPiecePoints || is_plane(scene.normals, rows)) continue;
    std::sort(rows.begin(), rows.end());
    for (const std::uint32_t k : rows) {
      piece.points.push_back(scene.points[k]);
      if (scene.oriented) piece.normals.push_back(scene.normals[k]);
    }
    points += rows.size();
    clouds.push_back(std::move(piece));
    if (points >= kPiecePointsAtOnce) align_those();
  }
  if (!clouds.empty()) align_those();
  return out;
}

}  // namespace gpureg::localization
