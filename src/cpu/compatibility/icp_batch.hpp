// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cmath>

#include "algorithm/evidence.hpp"
#include "cpu/common/wide_vectors.hpp"

namespace gpureg::cpu {

/// A point of the moved cloud beside its closest point.
struct IcpCorrespondence {
  Vec3 point, normal;  ///< of the moved cloud, in its own frame
  Vec3 moved;          ///< the point under the pose
  Vec3 other, other_normal;
  std::uint32_t weight;  ///< of the moved cloud's normal
};

/// What turns correspondences into terms.
struct IcpTerms {
  Rigid pose;
  float min_cosine, kernel_width, inverse_radius, inverse_max;
};

/// add_icp_term() for sixteen correspondences at a time, to the same bits; those whose normals
/// disagree have no terms. Truncated terms are integers of at most 2^40, so doubles add thousands
/// of them exactly.
class IcpBatch {
 public:
  static constexpr int kLanes = 16;

  explicit IcpBatch(const IcpTerms& terms) : terms_(terms) {}

  void add(const IcpCorrespondence& c) {
    px_[size_] = c.point.x;
    py_[size_] = c.point.y;
    pz_[size_] = c.point.z;
    mx_[size_] = c.normal.x;
    my_[size_] = c.normal.y;
    mz_[size_] = c.normal.z;
    // The terms need the difference only.
    const Vec3 d = c.moved - c.other;
    dx_[size_] = d.x;
    dy_[size_] = d.y;
    dz_[size_] = d.z;
    nx_[size_] = c.other_normal.x;
    ny_[size_] = c.other_normal.y;
    nz_[size_] = c.other_normal.z;
    weight_[size_] = c.weight;
    if (++size_ == kLanes) flush();
  }
  IcpSums sums() {
    // The rest of a partial batch gets weight zero.
    for (int l = size_; l < kLanes; ++l) weight_[l] = 0;
    if (size_ > 0) flush();
    settle();
    return total_;
  }

 private:
  static constexpr int kFlushes = 4096;  ///< 2^12 terms of up to 2^40 in each lane: below 2^53

  void flush() {
#ifdef GPUREG_WIDE_TARGET
    if (has_wide_vectors())
      flush_wide();
    else
#endif
      flush_in_vectors();
    size_ = 0;
    if (++flushes_ == kFlushes) settle();
  }
#ifdef GPUREG_WIDE_TARGET
  GPUREG_WIDE_TARGET void flush_wide() { flush_in_vectors(); }
#endif
  GPUREG_ALWAYS_INLINE void flush_in_vectors() {
    alignas(64) float j[6][kLanes], weighted[6][kLanes], residual[kLanes], weight[kLanes];
    const IcpTerms t = terms_;
    for (int l = 0; l < kLanes; ++l) {
      const Vec3 n{nx_[l], ny_[l], nz_[l]}, m = rotate(t.pose, {mx_[l], my_[l], mz_[l]});
      const float distance = dot(Vec3{dx_[l], dy_[l], dz_[l]}, n);
      const float w = robust_weight(distance, t.kernel_width) * normal_weight_share(weight_[l]);
      weight[l] = normals_agree(m, n, t.min_cosine) ? w : 0.0f;
      residual[l] = distance * t.inverse_max;
      const Vec3 turn = cross(rotate(t.pose, {px_[l], py_[l], pz_[l]}) * t.inverse_radius, n);
      j[0][l] = turn.x;
      j[1][l] = turn.y;
      j[2][l] = turn.z;
      j[3][l] = n.x;
      j[4][l] = n.y;
      j[5][l] = n.z;
    }
    for (int a = 0; a < 6; ++a)
      for (int l = 0; l < kLanes; ++l) weighted[a][l] = weight[l] * j[a][l];
    int k = 0;
    for (int a = 0; a < 6; ++a)
      for (int b = 0; b <= a; ++b) add_terms(weighted[a], j[b], sum_[k++]);
    for (int a = 0; a < 6; ++a) add_terms(weighted[a], residual, sum_[k++]);
  }
  GPUREG_ALWAYS_INLINE static void add_terms(const float* a, const float* b, double* sum) {
    for (int l = 0; l < kLanes; ++l)
      sum[l] += static_cast<double>(std::trunc(a[l] * b[l] * kIcpFixedScale));
  }
  void settle() {
    for (int k = 0; k < 27; ++k)
      for (int l = 0; l < kLanes; ++l) {
        total_.v[k] += static_cast<std::int64_t>(sum_[k][l]);
        sum_[k][l] = 0.0;
      }
    flushes_ = 0;
  }

  const IcpTerms terms_;
  alignas(64) float px_[kLanes] = {}, py_[kLanes] = {}, pz_[kLanes] = {}, mx_[kLanes] = {},
                    my_[kLanes] = {}, mz_[kLanes] = {}, dx_[kLanes] = {}, dy_[kLanes] = {},
                    dz_[kLanes] = {}, nx_[kLanes] = {}, ny_[kLanes] = {}, nz_[kLanes] = {};
  alignas(64) std::uint32_t weight_[kLanes] = {};
  alignas(64) double sum_[27][kLanes] = {};
  IcpSums total_{{0}};
  int size_ = 0, flushes_ = 0;
};

}  // namespace gpureg::cpu
