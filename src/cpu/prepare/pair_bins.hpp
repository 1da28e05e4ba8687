// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <vector>

#include "algorithm/fpfh.hpp"
#include "cpu/prepare/neighbor_rows.hpp"

namespace gpureg::cpu {

/// spfh_counts() with gathered neighbours and a branch-free pair_feature(), which the compiler
/// vectorises. The same operations on the same values give the same bins.
class PairBins {
 public:
  /// Counts of the point at a position, and the number of neighbours for normalisation.
  int spfh_counts(const NeighborRows& rows, std::size_t self, float radius, std::uint32_t* counts) {
    for (int b = 0; b < kFpfhSize; ++b) counts[b] = 0;
    const Vec3 p = rows.point(self), n = rows.normal(self);
    if (is_zero(n)) return 0;
    size_ = rows.within(p, radius, places_, squared_, [&](std::uint32_t k, float) {
      return (k != self) & !is_zero(rows.normal(k));
    });
    if (x_.size() < size_ + kLanes) grow();
    for (std::size_t k = 0; k < size_; ++k) {
      const Vec3 q = rows.point(places_[k]), m = rows.normal(places_[k]);
      x_[k] = q.x;
      y_[k] = q.y;
      z_[k] = q.z;
      mx_[k] = m.x;
      my_[k] = m.y;
      mz_[k] = m.z;
    }
    for (std::size_t first = 0; first < size_; first += kLanes) bin(first, p, n);
    for (std::size_t k = 0; k < size_; ++k) {
      const std::uint32_t bins = bins_[k];
      if (bins == kNoValue) continue;
      ++counts[bins & 0xffu];
      ++counts[kFpfhBins + ((bins >> 8) & 0xffu)];
      ++counts[2 * kFpfhBins + (bins >> 16)];
    }
    return static_cast<int>(size_);
  }

 private:
  void grow() {
    const std::size_t size = 2 * (size_ + kLanes);
    for (auto* v : {&x_, &y_, &z_, &mx_, &my_, &mz_}) v->resize(size);
    bins_.resize(size);
  }

  static constexpr int kLanes = 32;
  using Lanes = float[kLanes];
  static float absolute(float v) { return v < 0.0f ? -v : v; }

  /// exact_atan2() of each lane, with one selection per loop: the compiler turns two into a branch,
  /// which prevents vectors.
  static void angles(const Lanes& y, const Lanes& x, Lanes& out) {
    alignas(32) Lanes ax, ay, larger, smaller;
    for (int k = 0; k < kLanes; ++k) ax[k] = absolute(x[k]);
    for (int k = 0; k < kLanes; ++k) ay[k] = absolute(y[k]);
    for (int k = 0; k < kLanes; ++k) larger[k] = ax[k] > ay[k] ? ax[k] : ay[k];
    for (int k = 0; k < kLanes; ++k) smaller[k] = ax[k] > ay[k] ? ay[k] : ax[k];
    for (int k = 0; k < kLanes; ++k) {
      const float t = smaller[k] / larger[k], s = t * t;
      float c = -0.004054547753185034f;
      c = fmaf(c, s, 0.021862884983420372f);
      c = fmaf(c, s, -0.05591221898794174f);
      c = fmaf(c, s, 0.09642188996076584f);
      c = fmaf(c, s, -0.1390862613916397f);
      c = fmaf(c, s, 0.19946564733982086f);
      c = fmaf(c, s, -0.33329859375953674f);
      c = fmaf(c, s, 0.9999993443489075f);
      out[k] = c * t;
    }
    for (int k = 0; k < kLanes; ++k) out[k] = ay[k] > ax[k] ? 0.5f * kPi - out[k] : out[k];
    for (int k = 0; k < kLanes; ++k) out[k] = x[k] < 0.0f ? kPi - out[k] : out[k];
    for (int k = 0; k < kLanes; ++k) out[k] = y[k] < 0.0f ? -out[k] : out[k];
    for (int k = 0; k < kLanes; ++k) out[k] = larger[k] > 0.0f ? out[k] : 0.0f;
  }

  /// fpfh_bin() of each lane. Limited before the conversion, which is undefined for the NaN of
  /// lanes that are not used.
  static void bins_of(const Lanes& unit, std::int32_t* out) {
    constexpr auto kLast = static_cast<float>(kFpfhBins - 1);
    alignas(32) Lanes scaled;
    for (int k = 0; k < kLanes; ++k) scaled[k] = static_cast<float>(kFpfhBins) * unit[k];
    for (int k = 0; k < kLanes; ++k) scaled[k] = scaled[k] > 0.0f ? scaled[k] : 0.0f;
    for (int k = 0; k < kLanes; ++k) scaled[k] = scaled[k] < kLast ? scaled[k] : kLast;
    for (int k = 0; k < kLanes; ++k) out[k] = static_cast<std::int32_t>(scaled[k]);
  }

  /// pair_feature() of the lanes from `first` on; lanes beyond the neighbours hold unused old
  /// values.
  void bin(std::size_t first, Vec3 p, Vec3 n) {
    const float *x = &x_[first], *y = &y_[first], *z = &z_[first], *mx = &mx_[first],
                *my = &my_[first], *mz = &mz_[first];
    alignas(32) Lanes dx, dy, dz, length, a1, a2, phi, fx, fy, fz, tx, ty, tz, v_norm, alpha, sine,
        cosine, theta;
    for (int k = 0; k < kLanes; ++k) {
      const Vec3 d = Vec3{x[k], y[k], z[k]} - p;
      length[k] = norm(d);
      a1[k] = dot(n, d) / length[k];
      a2[k] = dot(Vec3{mx[k], my[k], mz[k]}, d) / length[k];
      dx[k] = d.x;
      dy[k] = d.y;
      dz[k] = d.z;
    }
    // Masks select the source point of the feature without a branch.
    alignas(32) std::int32_t turned[kLanes];
    for (int k = 0; k < kLanes; ++k) {
      phi[k] = absolute(a1[k]);
      theta[k] = absolute(a2[k]);
    }
    for (int k = 0; k < kLanes; ++k) turned[k] = phi[k] < theta[k] ? 1 : 0;
    for (int k = 0; k < kLanes; ++k) phi[k] = turned[k] ? -a2[k] : a1[k];
    for (int k = 0; k < kLanes; ++k) dx[k] = turned[k] ? -dx[k] : dx[k];
    for (int k = 0; k < kLanes; ++k) dy[k] = turned[k] ? -dy[k] : dy[k];
    for (int k = 0; k < kLanes; ++k) dz[k] = turned[k] ? -dz[k] : dz[k];
    for (int k = 0; k < kLanes; ++k) fx[k] = turned[k] ? mx[k] : n.x;
    for (int k = 0; k < kLanes; ++k) fy[k] = turned[k] ? my[k] : n.y;
    for (int k = 0; k < kLanes; ++k) fz[k] = turned[k] ? mz[k] : n.z;
    for (int k = 0; k < kLanes; ++k) tx[k] = turned[k] ? n.x : mx[k];
    for (int k = 0; k < kLanes; ++k) ty[k] = turned[k] ? n.y : my[k];
    for (int k = 0; k < kLanes; ++k) tz[k] = turned[k] ? n.z : mz[k];
    for (int k = 0; k < kLanes; ++k) {
      const Vec3 from{fx[k], fy[k], fz[k]}, to{tx[k], ty[k], tz[k]};
      Vec3 v = cross({dx[k], dy[k], dz[k]}, from);
      v_norm[k] = norm(v);
      v = {v.x / v_norm[k], v.y / v_norm[k], v.z / v_norm[k]};
      const Vec3 w = cross(from, v);
      alpha[k] = dot(v, to);
      sine[k] = dot(w, to);
      cosine[k] = dot(from, to);
    }
    angles(sine, cosine, theta);
    for (int k = 0; k < kLanes; ++k) {
      theta[k] = (theta[k] + kPi) * (0.5f / kPi);
      alpha[k] = (alpha[k] + 1.0f) * 0.5f;
      phi[k] = (phi[k] + 1.0f) * 0.5f;
    }
    alignas(32) std::int32_t b0[kLanes], b1[kLanes], b2[kLanes];
    bins_of(theta, b0);
    bins_of(alpha, b1);
    bins_of(phi, b2);
    std::uint32_t* bins = &bins_[first];
    for (int k = 0; k < kLanes; ++k)
      bins[k] = static_cast<std::uint32_t>(b0[k] | b1[k] << 8 | b2[k] << 16);
    for (int k = 0; k < kLanes; ++k) bins[k] = length[k] > 0.0f ? bins[k] : kNoValue;
    for (int k = 0; k < kLanes; ++k) bins[k] = v_norm[k] > 0.0f ? bins[k] : kNoValue;
  }

  std::vector<float> x_, y_, z_, mx_, my_, mz_, squared_;
  std::vector<std::uint32_t> places_;
  std::vector<std::uint32_t> bins_;
  std::size_t size_ = 0;
};

}  // namespace gpureg::cpu
