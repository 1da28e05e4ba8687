// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <vector>

#include "pipeline/types.hpp"

namespace gpureg {

/// A raw cloud, and the rows of it that are left where some were dropped.
class KeptRows {
 public:
  explicit KeptRows(const RawCloud& raw) : cloud_(raw) {}
  KeptRows(const KeptRows&) = delete;
  KeptRows& operator=(const KeptRows&) = delete;

  void keep(const RawCloud& raw, const std::vector<std::uint32_t>& rows) {
    points_ = chosen(raw.points, 3, raw.point_stride, rows);
    cloud_.points = points_.data();
    cloud_.size = rows.size();
    cloud_.point_stride = 3;
    if (raw.normals) {
      normals_ = chosen(raw.normals, 3, raw.normal_stride, rows);
      cloud_.normals = normals_.data();
      cloud_.normal_stride = 3;
    }
    if (!raw.features) return;
    features_ = chosen(raw.features, raw.feature_dimension, raw.feature_stride, rows);
    cloud_.features = features_.data();
    cloud_.feature_stride = raw.feature_dimension;
  }

  /// Valid as long as this object and the rows that it was made of.
  const RawCloud& cloud() const { return cloud_; }

 private:
  static std::vector<float> chosen(const float* values, std::size_t width, std::size_t stride,
                                   const std::vector<std::uint32_t>& rows) {
    std::vector<float> out;
    out.reserve(width * rows.size());
    for (const std::uint32_t row : rows)
      out.insert(out.end(), values + row * stride, values + row * stride + width);
    return out;
  }

  RawCloud cloud_;
  std::vector<float> points_, normals_, features_;
};

}  // namespace gpureg
