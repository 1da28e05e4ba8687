// SPDX-License-Identifier: BSD-3-Clause
#include "localization/check_scan.hpp"

#include <algorithm>
#include <sstream>

#include "common/coordinates.hpp"
#include "common/shown.hpp"
#include "flat/scan_plane.hpp"
#include "gpureg/voxel_size.hpp"

namespace gpureg::localization {
namespace {

/// Points farther apart than so many voxels have no neighbourhoods; a cloud of fewer voxels has no
/// shape.
constexpr double kSparse = 10, kSmall = 10;
/// Scans of more voxels are unusual: worth a look at the spacing.
constexpr double kWide = 2000;

/// Of the middle 90 % along each axis: stray points do not count.
struct Extent {
  double longest = 0;   ///< along an axis
  double farthest = 0;  ///< coordinate
};

Extent extent_of(const PointCloudView& scan) {
  constexpr std::size_t kSample = 4096;
  Extent out;
  for (int axis = 0; axis < 3; ++axis) {
    std::vector<float> values;
    for (std::size_t k = 0; k < scan.size; k += scan.size / kSample + 1) {
      const Eigen::Map<const Eigen::Vector3f> p(scan.points + k * scan.point_stride);
      if (p.allFinite()) values.push_back(p[axis]);
    }
    if (values.empty()) return out;
    std::sort(values.begin(), values.end());
    const std::size_t cut = values.size() / 20;
    const double low = static_cast<double>(values[cut]),
                 high = static_cast<double>(values[values.size() - 1 - cut]);
    out.longest = std::max(out.longest, high - low);
    out.farthest = std::max({out.farthest, -low, high});
  }
  return out;
}

std::string looks_like(double factor, const char* scan, const char* map) {
  std::ostringstream text;
  text << "; it looks like " << scan << ", and the map like " << map << ": multiply the scan by "
       << factor;
  return text.str();
}

}  // namespace

void check_unit(const PointCloudView& scan, const MapState& map, const std::string& name) {
  const double voxel = static_cast<double>(map.options.prepare.voxel_size);
  const Extent found = extent_of(scan);
  const double extent = found.longest, farthest = found.farthest;
  if (farthest > limits::kMaxCoordinate)
    throw InvalidArgument(name + ": its points lie " + shown(farthest) +
                          " from the origin of its frame, expected at most 1e12");
  if (extent == 0) return;  // too few points, which is for the result to say
  const auto fits = [&](double spacing, double factor) {
    return spacing * factor < 2 * voxel && extent * factor > 2 * kSmall * voxel;
  };
  if (extent >= kSmall * voxel && extent <= kWide * voxel) return;
  std::ostringstream text;
  text.precision(3);
  const double spacing = suggest_voxel_size({scan}).spacing;
  if (spacing > kSparse * voxel) {
    text << name << ": its points are " << spacing << " apart, but the voxels of the map are "
         << voxel;
    if (fits(spacing, 1e-2) && !fits(spacing, 1e-1) && spacing < 40 * voxel)
      text << looks_like(1e-2, "centimetres", "metres");
    else if (fits(spacing, 1e-3))
      text << looks_like(1e-3, "millimetres", "metres");
    else if (fits(spacing, 1e-2))
      text << looks_like(1e-2, "centimetres", "metres");
    else
      text << ": it is too sparse for this map";
  } else if (extent < kSmall * voxel) {
    text << name << ": it extends over " << extent << ", but the voxels of the map are " << voxel;
    if (fits(spacing, 1e3))
      text << looks_like(1e3, "metres", "millimetres");
    else if (fits(spacing, 1e2))
      text << looks_like(1e2, "metres", "centimetres");
    else
      return;  // too small to be recognised, which is for the result to say
  } else {
    return;
  }
  throw InvalidArgument(text.str());
}

void refuse_flat(const PointCloudView& cloud, const std::string& name) {
  if (find_scan_plane(cloud.points, cloud.size, cloud.point_stride))
    throw InvalidArgument(name +
                          " is of a 2-D scanner, and places are found in three dimensions only; "
                          "align 2-D scans with one another");
}

void check_map(const PointCloud& cloud, const MapSettings& options) {
  const double voxel = static_cast<double>(options.prepare.voxel_size);
  const double spacing = suggest_voxel_size({cloud.view()}).spacing;
  const double extent = extent_of(cloud.view()).longest;
  std::ostringstream text;
  text.precision(3);
  if (spacing > kSparse * voxel)
    text << "the points of the map are " << spacing << " apart";
  else if (extent < kSmall * voxel)
    text << "the map extends over " << extent << " only";
  else
    return;
  text << ", but voxel_size is " << voxel << ": it does not fit, or is in another unit";
  throw InvalidArgument(text.str());
}

}  // namespace gpureg::localization
