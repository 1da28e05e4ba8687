// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "algorithm/evidence.hpp"

namespace gpureg::cpu {

/// add_icp_term() for eight correspondences at a time, to the same bits. Truncated terms are
/// integers of at most 2^40, so doubles add thousands of them exactly.
class IcpBatch {
 public:
  static constexpr int kLanes = 8;

  void add(Vec3 arm, Vec3 normal, float residual, float weight) {
    ax_[size_] = arm.x;
    ay_[size_] = arm.y;
    az_[size_] = arm.z;
    nx_[size_] = normal.x;
    ny_[size_] = normal.y;
    nz_[size_] = normal.z;
    residual_[size_] = residual;
    weight_[size_] = weight;
    if (++size_ == kLanes) flush();
  }
  IcpSums sums() {
    // Missing correspondences of a partial batch get weight zero.
    for (; size_ > 0 && size_ < kLanes; ++size_)
      ax_[size_] = ay_[size_] = az_[size_] = nx_[size_] = ny_[size_] = nz_[size_] =
          residual_[size_] = weight_[size_] = 0.0f;
    if (size_ > 0) flush();
    settle();
    return total_;
  }

 private:
  static constexpr int kFlushes = 4096;  ///< 2^12 terms of up to 2^40 in each lane: below 2^53

  void flush() {
    alignas(32) float j[6][kLanes], weighted[6][kLanes];
    for (int l = 0; l < kLanes; ++l) {
      const Vec3 turn = cross({ax_[l], ay_[l], az_[l]}, {nx_[l], ny_[l], nz_[l]});
      j[0][l] = turn.x;
      j[1][l] = turn.y;
      j[2][l] = turn.z;
      j[3][l] = nx_[l];
      j[4][l] = ny_[l];
      j[5][l] = nz_[l];
    }
    for (int a = 0; a < 6; ++a)
      for (int l = 0; l < kLanes; ++l) weighted[a][l] = weight_[l] * j[a][l];
    int k = 0;
    for (int a = 0; a < 6; ++a)
      for (int b = 0; b <= a; ++b) add_terms(weighted[a], j[b], sum_[k++]);
    for (int a = 0; a < 6; ++a) add_terms(weighted[a], residual_, sum_[k++]);
    size_ = 0;
    if (++flushes_ == kFlushes) settle();
  }
  static void add_terms(const float* a, const float* b, double* sum) {
    for (int l = 0; l < kLanes; ++l)
      sum[l] += std::trunc(static_cast<double>(a[l] * b[l] * kIcpFixedScale));
  }
  void settle() {
    for (int k = 0; k < 27; ++k)
      for (int l = 0; l < kLanes; ++l) {
        total_.v[k] += static_cast<std::int64_t>(sum_[k][l]);
        sum_[k][l] = 0.0;
      }
    flushes_ = 0;
  }

  alignas(32) float ax_[kLanes], ay_[kLanes], az_[kLanes], nx_[kLanes], ny_[kLanes], nz_[kLanes],
      residual_[kLanes], weight_[kLanes];
  alignas(32) double sum_[27][kLanes] = {};
  IcpSums total_{{0}};
  int size_ = 0, flushes_ = 0;
};

}  // namespace gpureg::cpu
