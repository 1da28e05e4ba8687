// SPDX-License-Identifier: BSD-3-Clause
#include "localization/find/part_evidence.hpp"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <limits>

#include "math/jacobi.hpp"

namespace gpureg::localization {
namespace {

constexpr float kInfinite = std::numeric_limits<float>::infinity();
/// Cosine of the largest angle between the normals of part and scene: 37 degrees. Edges turn
/// normals that are estimated.
constexpr float kSimilar = 0.8f;
/// Distances from the plane of the scene, in voxels, within which a point of the part lies on it.
constexpr float kOn = 1;
/// Voxels in front of or behind a surface within which nothing is violated or hidden.
constexpr float kMargin = 2;
/// Surfaces more oblique than this, as the cosine to the line of sight, violate nothing: a small
/// error of the pose moves them far along it.
constexpr float kOblique = 0.25f;
/// Pixels beyond the outline at which the scene has to recede.
constexpr int kBeyond = 2;
constexpr int kLargestImage = 400;  ///< pixels of an edge
constexpr int kRefinements = 8;

Eigen::Vector3f any_normal_to(const Eigen::Vector3f& z) {
  int axis = 0;
  z.cwiseAbs().minCoeff(&axis);
  return z.cross(Eigen::Vector3f::Unit(axis)).normalized();
}

RowPose small_motion(const Eigen::Matrix<double, 6, 1>& x, const Eigen::Vector3d& centre) {
  // A unit quaternion of the half angles: no trigonometric functions, whose bits depend on libm.
  const Eigen::Quaterniond q =
      Eigen::Quaterniond(1, 0.5 * x[0], 0.5 * x[1], 0.5 * x[2]).normalized();
  RowPose motion = RowPose::Identity();
  motion.linear() = q.toRotationMatrix();
  motion.translation() = centre + x.tail<3>() - motion.linear() * centre;
  return motion;
}

}  // namespace

/// The supported surface so far.
struct PartVerifier::Sums {
  Eigen::Vector3d centre;
  double radius;
  double information[6][6] = {};
  double squared = 0;
  std::size_t count = 0;
  std::vector<std::uint32_t> claimed;

  void add(const Eigen::Vector3f& point, const Eigen::Vector3f& normal,
           const SceneSurface::Nearest& nearest, std::uint32_t block) {
    const Eigen::Vector3d n = normal.cast<double>(),
                          turn = (point.cast<double>() - centre).cross(n) / radius;
    const double row[6] = {turn.x(), turn.y(), turn.z(), n.x(), n.y(), n.z()};
    for (int i = 0; i < 6; ++i)
      for (int j = 0; j < 6; ++j) information[i][j] += row[i] * row[j];
    squared += static_cast<double>(nearest.along) * static_cast<double>(nearest.along);
    ++count;
    claimed.push_back(block);
  }

  void conclude(float voxel, Verdict& out) {
    std::sort(claimed.begin(), claimed.end());
    claimed.erase(std::unique(claimed.begin(), claimed.end()), claimed.end());
    out.claimed = std::move(claimed);
    if (count == 0) return;
    const double n = static_cast<double>(count);
    out.evidence.residual = std::sqrt(squared / n) / static_cast<double>(voxel);
    double a[6][6], v[6][6];
    for (int i = 0; i < 6; ++i)
      for (int j = 0; j < 6; ++j) a[i][j] = information[i][j] / n;
    jacobi_eigen<6, 10>(a, v);
    double values[6];
    for (int i = 0; i < 6; ++i) values[i] = std::max(a[i][i], 0.0);
    std::sort(values, values + 6);
    out.evidence.weakest = values[0];
    out.evidence.third_weakest = values[2];
  }
};

/// The part at a pose and the scene, from one viewpoint, a voxel at the part's middle a pixel.
struct PartVerifier::Image {
  int size = 0;
  Eigen::Vector3f eye, x, y, z;
  float scale = 0;                               ///< pixels per unit of X / Z
  std::vector<float> part, least, most;          ///< depths; of the scene nearest and farthest
  std::vector<std::uint32_t> index;              ///< of the part's point in front
  std::vector<char> filled;                      ///< hole between points of the part
  std::vector<Eigen::Vector3f> points, normals;  ///< of the part, moved, relative to the eye

  int at(int row, int column) const { return row * size + column; }
  bool has_part(int k) const { return part[static_cast<std::size_t>(k)] < kInfinite; }
  /// -1: outside.
  int pixel(const Eigen::Vector3f& p, float depth) const {
    const float u = x.dot(p) / depth * scale, v = y.dot(p) / depth * scale,
                half = 0.5f * static_cast<float>(size);
    if (!(std::abs(u) < half - 1 && std::abs(v) < half - 1)) return -1;
    return at(static_cast<int>(v + half), static_cast<int>(u + half));
  }
  /// Depths of the scene in the nine pixels around.
  std::pair<float, float> window(int k) const {
    float low = kInfinite, high = 0;
    for (int r = -1; r <= 1; ++r)
      for (int c = -1; c <= 1; ++c) {
        const auto i = static_cast<std::size_t>(k + r * size + c);
        low = std::min(low, least[i]);
        high = std::max(high, most[i]);
      }
    return {low, high};
  }
};

PartVerifier::PartVerifier(const PartSurface& part, const SceneSurface& scene,
                           const std::vector<SceneView>& views, float voxel)
    : part_(part), scene_(scene), views_(views), voxel_(voxel) {
  for (const Eigen::Vector3f& p : part.points) mean_ += p.cast<double>();
  const double n = static_cast<double>(std::max<std::size_t>(part.points.size(), 1));
  mean_ /= n;
  for (const Eigen::Vector3f& p : part.points) {
    const Eigen::Vector3d d = p.cast<double>() - mean_;
    spread_ += d * d.transpose() / n;
  }
}

double PartVerifier::displacement(const RowPose& a, const RowPose& b) const {
  const Eigen::Matrix3d m = a.linear() - b.linear();
  return std::sqrt(
      std::max(0.0, (m * spread_ * m.transpose()).trace() + (a * mean_ - b * mean_).squaredNorm()));
}

bool PartVerifier::draw(const RowPose& pose, const SceneView& view, Image& image) const {
  const Eigen::Vector3f middle = (pose * part_.middle).cast<float>() - view.viewpoint();
  const float range = middle.norm();
  if (!(range > 1.5f * part_.radius)) return false;
  image.eye = view.viewpoint();
  image.z = middle / range;
  image.x = any_normal_to(image.z);
  image.y = image.z.cross(image.x);
  image.scale = range / voxel_;
  // The nearest part of the sphere around the part looks the largest.
  const float half = part_.radius / (range - part_.radius) * image.scale;
  image.size = std::min(2 * (static_cast<int>(half) + kBeyond + 3), kLargestImage);
  const auto pixels = static_cast<std::size_t>(image.size * image.size);
  image.part.assign(pixels, kInfinite);
  image.least.assign(pixels, kInfinite);
  image.most.assign(pixels, 0);
  image.index.assign(pixels, 0);
  image.filled.assign(pixels, 0);
  const Eigen::Matrix3f turn = pose.linear().cast<float>();
  const Eigen::Vector3f shift = pose.translation().cast<float>() - view.viewpoint();
  image.points.resize(part_.points.size());
  image.normals.resize(part_.points.size());
  for (std::uint32_t k = 0; k < part_.points.size(); ++k) {
    Eigen::Vector3f& p = image.points[k];
    p = turn * part_.points[k] + shift;
    Eigen::Vector3f& n = image.normals[k];
    n = turn * part_.normals[k];
    const float away = n.dot(p);
    if (away > 0) {
      if (part_.oriented) continue;
      n = -n;
    }
    const float depth = image.z.dot(p);
    const int pixel = image.pixel(p, depth);
    if (pixel < 0 || depth >= image.part[static_cast<std::size_t>(pixel)]) continue;
    image.part[static_cast<std::size_t>(pixel)] = depth;
    image.index[static_cast<std::size_t>(pixel)] = k;
  }
  for (int r = 1; r + 1 < image.size; ++r)
    for (int c = 1; c + 1 < image.size; ++c) {
      const int k = image.at(r, c);
      if (image.has_part(k)) continue;
      const int around = image.has_part(k - 1) + image.has_part(k + 1) +
                         image.has_part(k - image.size) + image.has_part(k + image.size);
      image.filled[static_cast<std::size_t>(k)] = around >= 3;
    }
  const float reach = static_cast<float>(image.size) * 0.7072f / image.scale;
  const float cosine = 1 / std::sqrt(1 + reach * reach);
  view.visit_cone(image.z, cosine, reach * cosine, [&](const Eigen::Vector3f& p) {
    const float depth = image.z.dot(p);
    if (depth <= 0) return;
    const int pixel = image.pixel(p, depth);
    if (pixel < 0) return;
    float& low = image.least[static_cast<std::size_t>(pixel)];
    float& high = image.most[static_cast<std::size_t>(pixel)];
    low = std::min(low, depth);
    high = std::max(high, depth);
  });
  return true;
}

PartVerifier::Verdict PartVerifier::verify_in(const RowPose& pose, const SceneView& view) const {
  Verdict out;
  out.evidence.viewpoint_known = true;
  Image image;
  if (!draw(pose, view, image)) return out;
  Sums sums;
  sums.centre = pose * part_.middle;
  sums.radius = static_cast<double>(part_.radius);
  const float margin = kMargin * voxel_;
  std::size_t in_view = 0, occluded = 0, violated = 0, open = 0, receding = 0, going_on = 0;
  for (int r = 1; r + 1 < image.size; ++r) {
    for (int c = 1; c + 1 < image.size; ++c) {
      const int k = image.at(r, c);
      if (!image.has_part(k)) continue;
      ++in_view;
      const std::uint32_t index = image.index[static_cast<std::size_t>(k)];
      const Eigen::Vector3f &p = image.points[index], &n = image.normals[index];
      const float depth = image.part[static_cast<std::size_t>(k)];
      const auto [low, high] = image.window(k);
      const Eigen::Vector3f place = p + image.eye;
      const SceneSurface::Nearest nearest = scene_.nearest(place, n, kSimilar);
      const bool on =
          nearest.index != SceneSurface::kNone && std::abs(nearest.along) <= kOn * voxel_;
      if (!on) {
        if (high == 0) continue;  // nothing seen there
        if (high < depth - margin) {
          ++occluded;
          continue;
        }
        ++open;
        const float cosine = -n.dot(p) / p.norm();
        violated += low > depth + margin && cosine > kOblique;
        continue;
      }
      // Whatever lies on the scene behind something else is not seen either.
      if (high > 0 && high < depth - margin) {
        ++occluded;
        continue;
      }
      ++open;
      sums.add(place, n, nearest, scene_.block(nearest.index));
      for (const auto& [dr, dc] :
           {std::pair(0, 1), std::pair(0, -1), std::pair(1, 0), std::pair(-1, 0)}) {
        const int row = r + kBeyond * dr, column = c + kBeyond * dc;
        if (row < 1 || column < 1 || row + 1 >= image.size || column + 1 >= image.size) continue;
        const int beside = image.at(r + dr, c + dc), beyond = image.at(row, column);
        if (image.has_part(beside) || image.filled[static_cast<std::size_t>(beside)] != 0 ||
            image.has_part(beyond))
          continue;
        const float seen = image.least[static_cast<std::size_t>(beyond)],
                    farthest = image.most[static_cast<std::size_t>(beyond)];
        if (farthest == 0) continue;
        // Where the plane of the part would be seen beyond the outline.
        const Eigen::Vector3f ray =
            image.z + (image.x * (static_cast<float>(column - image.size / 2) + 0.5f) +
                       image.y * (static_cast<float>(row - image.size / 2) + 0.5f)) /
                          image.scale;
        const float facing = n.dot(ray);
        const float level = facing < -kOblique ? n.dot(p) / facing : depth;
        if (farthest < level - margin) continue;  // something in front
        if (seen > level + 0.75f * margin)
          ++receding;
        else
          ++going_on;
      }
    }
  }
  PartEvidence& e = out.evidence;
  const auto share = [](std::size_t a, std::size_t b) {
    return b == 0 ? 0.0 : static_cast<double>(a) / static_cast<double>(b);
  };
  e.occluded = share(occluded, in_view);
  e.supported = share(sums.count, open);
  e.violated = share(violated, open);
  e.contour = receding + going_on == 0 ? 0.5 : share(receding, receding + going_on);
  const double pixel = static_cast<double>(voxel_) / static_cast<double>(part_.diameter);
  e.contour_length = static_cast<double>(receding + going_on) * pixel;
  e.area = static_cast<double>(sums.count) * pixel * pixel;
  e.cell = pixel;
  sums.conclude(voxel_, out);
  return out;
}

PartVerifier::Verdict PartVerifier::verify_unseen(const RowPose& pose) const {
  Verdict out;
  Sums sums;
  sums.centre = pose * part_.middle;
  sums.radius = static_cast<double>(part_.radius);
  const std::size_t directions = look_directions().size();
  std::vector<std::size_t> seen(directions, 0), on(directions, 0);
  std::vector<SceneSurface::Nearest> nearest(part_.points.size());
  const auto is_on = [&](std::size_t k) {
    return nearest[k].index != SceneSurface::kNone && std::abs(nearest[k].along) <= kOn * voxel_;
  };
  const Eigen::Matrix3f turn = pose.linear().cast<float>();
  const Eigen::Vector3f shift = pose.translation().cast<float>();
  for (std::size_t k = 0; k < part_.points.size(); ++k) {
    if (part_.seen_from[k] == 0) continue;
    nearest[k] = scene_.nearest(turn * part_.points[k] + shift, turn * part_.normals[k], kSimilar);
    for (std::size_t d = 0; d < directions; ++d) {
      const std::size_t sees = part_.seen_from[k] >> d & 1;
      seen[d] += sees;
      on[d] += is_on(k) ? sees : 0;
    }
  }
  // The direction from which most of the surface would be seen, of that which the scene has.
  std::size_t best = 0;
  double most = -1;
  for (std::size_t d = 0; d < directions; ++d) {
    if (seen[d] == 0) continue;
    const double share = static_cast<double>(on[d]) / static_cast<double>(seen[d]);
    const double value = share * static_cast<double>(on[d]);
    if (value > most) {
      most = value;
      best = d;
    }
  }
  if (seen[best] == 0) return out;
  for (std::size_t k = 0; k < part_.points.size(); ++k)
    if ((part_.seen_from[k] >> best & 1) != 0 && is_on(k))
      sums.add(turn * part_.points[k] + shift, turn * part_.normals[k], nearest[k],
               scene_.block(nearest[k].index));
  out.evidence.supported = static_cast<double>(sums.count) / static_cast<double>(seen[best]);
  out.evidence.contour = 0.5;
  const double disc = static_cast<double>(part_.spacing) / static_cast<double>(part_.diameter);
  out.evidence.area = static_cast<double>(sums.count) * disc * disc;
  out.evidence.cell = disc;
  sums.conclude(voxel_, out);
  return out;
}

PartVerifier::Verdict PartVerifier::verify(const RowPose& pose) const {
  if (views_.empty()) return verify_unseen(pose);
  Verdict best = verify_in(pose, views_.front());
  for (std::size_t k = 1; k < views_.size(); ++k) {
    Verdict other = verify_in(pose, views_[k]);
    if (other.evidence.area > best.evidence.area) best = std::move(other);
  }
  return best;
}

std::vector<std::uint32_t> PartVerifier::in_view(const RowPose& pose) const {
  std::vector<std::uint32_t> out;
  for (const SceneView& view : views_) {
    Image image;
    if (!draw(pose, view, image)) continue;
    for (std::size_t k = 0; k < image.part.size(); ++k)
      if (image.part[k] < kInfinite) out.push_back(image.index[k]);
  }
  if (views_.empty())
    for (std::uint32_t k = 0; k < part_.points.size(); ++k)
      if (part_.seen_from[k] != 0) out.push_back(k);
  std::sort(out.begin(), out.end());
  out.erase(std::unique(out.begin(), out.end()), out.end());
  return out;
}

RowPose PartVerifier::refined(const RowPose& first) const {
  RowPose pose = first;
  const std::vector<std::uint32_t> rows = in_view(pose);
  const double kernel = static_cast<double>(voxel_);
  for (int step = 0; step < kRefinements; ++step) {
    Eigen::Matrix<double, 6, 6> information = Eigen::Matrix<double, 6, 6>::Zero();
    Eigen::Matrix<double, 6, 1> gradient = Eigen::Matrix<double, 6, 1>::Zero();
    const Eigen::Vector3d centre = pose * part_.middle;
    const Eigen::Matrix3f turn = pose.linear().cast<float>();
    const Eigen::Vector3f shift = pose.translation().cast<float>();
    double count = 0;
    for (const std::uint32_t k : rows) {
      const Eigen::Vector3f p = turn * part_.points[k] + shift;
      const SceneSurface::Nearest found = scene_.nearest(p, turn * part_.normals[k], kSimilar);
      if (found.index == SceneSurface::kNone) continue;
      const Eigen::Vector3d n = scene_.normal(found.index).cast<double>();
      const double along = static_cast<double>(found.along);
      const double ratio = along / kernel, weight = 1 / ((1 + ratio * ratio) * (1 + ratio * ratio));
      Eigen::Matrix<double, 6, 1> row;
      row << (p.cast<double>() - centre).cross(n), n;
      information += weight * row * row.transpose();
      gradient -= weight * along * row;
      count += weight;
    }
    if (count < 6) return first;
    const double radius = static_cast<double>(part_.radius);
    // Directions that the surface does not hold stay where they are.
    information.topLeftCorner<3, 3>().diagonal().array() += 1e-3 * count * radius * radius;
    information.bottomRightCorner<3, 3>().diagonal().array() += 1e-3 * count;
    const Eigen::Matrix<double, 6, 1> x = information.ldlt().solve(gradient);
    if (!x.allFinite()) return first;
    pose = small_motion(x, centre) * pose;
  }
  return pose;
}

}  // namespace gpureg::localization
