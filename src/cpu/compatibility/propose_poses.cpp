// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>

#include "algorithm/fit.hpp"
#include "cpu/common/stages.hpp"
#include "cpu/common/wide_vectors.hpp"
#include "cpu/compatibility/compatibility.hpp"

namespace gpureg::cpu {
namespace {

constexpr std::uint32_t kBlock = kMaskBits;

/// Neighbourhood of a seed: the seed, then the first of its compatible matches.
struct Members {
  std::vector<float> px, py, pz, qx, qy, qz;
  std::vector<std::uint32_t> weight, match;
  std::vector<std::uint32_t> remaining;  ///< weight of each block of members and of all after it
  std::uint32_t size = 0;

  explicit Members(std::uint32_t most) {
    for (auto* v : {&px, &py, &pz, &qx, &qy, &qz}) v->resize(most);
    weight.resize(most);
    match.resize(most);
    remaining.resize(most / kBlock + 1);
  }
  template <typename Mask>
  GPUREG_ALWAYS_INLINE void gather(const MatchSet& m, std::uint32_t seed,
                                   const CompatibilityTest& test, std::uint32_t most) {
    size = 0;
    add(m, seed);
    const MatchColumns columns(m);
    const OrientedMatch own = columns[seed];
    const std::uint32_t n = m.size();
    std::uint8_t flag[kBlock] = {};
    for (std::uint32_t from = 0; from < n && size < most; from += kBlock) {
      const std::uint32_t count = std::min(n - from, kBlock);
      const MatchColumns block(m, from);
      for (std::uint32_t k = 0; k < count; ++k) flag[k] = compatible(block[k], own, test);
      for (std::uint32_t k = count; k < kBlock; ++k) flag[k] = 0;
      std::uint64_t mask = Mask::of(flag);
      if (seed - from < kBlock) mask &= ~(std::uint64_t(1) << (seed - from));
      for (; mask != 0 && size < most; mask &= mask - 1)
        add(m, from + static_cast<std::uint32_t>(__builtin_ctzll(mask)));
    }
    std::uint32_t after = 0;
    for (std::uint32_t k = size; k-- > 0;) {
      after += weight[k];
      if (k % kBlock == 0) remaining[k / kBlock] = after;
    }
  }
  Vec3 source(std::uint32_t k) const { return {px[k], py[k], pz[k]}; }
  Vec3 target(std::uint32_t k) const { return {qx[k], qy[k], qz[k]}; }

  /// Total weight of the members that the motion aligns. Stops, with a value up to `best`, as soon
  /// as more is out of range.
  GPUREG_ALWAYS_INLINE std::uint32_t support(const Rigid& pose, float squared_distance,
                                             std::uint32_t best) const {
    const float *ax = px.data(), *ay = py.data(), *az = pz.data(), *bx = qx.data(), *by = qy.data(),
                *bz = qz.data();
    const std::uint32_t* w = weight.data();
    std::uint32_t total = 0;
    for (std::uint32_t begin = 0; begin < size; begin += kBlock) {
      if (total + remaining[begin / kBlock] <= best) return total;
      const std::uint32_t end = std::min(size, begin + kBlock);
      for (std::uint32_t k = begin; k < end; ++k)
        total += squared_norm(apply(pose, {ax[k], ay[k], az[k]}) - Vec3{bx[k], by[k], bz[k]}) <
                         squared_distance
                     ? w[k]
                     : 0u;
    }
    return total;
  }

 private:
  void add(const MatchSet& m, std::uint32_t k) {
    px[size] = m.px[k];
    py[size] = m.py[k];
    pz[size] = m.pz[k];
    qx[size] = m.qx[k];
    qy[size] = m.qy[k];
    qz[size] = m.qz[k];
    weight[size] = m.source_weight[k] + m.target_weight[k];
    match[size] = k;
    ++size;
  }
};

/// Least-squares fit to the members that the pose aligns; false where they do not determine a pose.
template <typename Mask>
GPUREG_ALWAYS_INLINE bool refit(const Members& members, float squared_distance, Pose<float>& pose) {
  const Rigid rigid = to_rigid(pose);
  Vec3 p[limits::kMaxMembers], q[limits::kMaxMembers];
  std::uint8_t flag[kBlock] = {};
  int n = 0;
  for (std::uint32_t begin = 0; begin < members.size; begin += kBlock) {
    const std::uint32_t count = std::min(members.size - begin, kBlock);
    const float *px = &members.px[begin], *py = &members.py[begin], *pz = &members.pz[begin],
                *qx = &members.qx[begin], *qy = &members.qy[begin], *qz = &members.qz[begin];
    for (std::uint32_t k = 0; k < count; ++k)
      flag[k] = squared_norm(apply(rigid, {px[k], py[k], pz[k]}) - Vec3{qx[k], qy[k], qz[k]}) <
                squared_distance;
    for (std::uint32_t k = count; k < kBlock; ++k) flag[k] = 0;
    for (std::uint64_t mask = Mask::of(flag); mask != 0; mask &= mask - 1) {
      const int k = __builtin_ctzll(mask);
      p[n] = {px[k], py[k], pz[k]};
      q[n] = {qx[k], qy[k], qz[k]};
      ++n;
    }
  }
  return fit_rigid(p, q, n, pose);
}

/// The triangle of the seed and two compatible members with the largest consensus weight, refitted
/// to its consensus set.
template <typename Mask>
GPUREG_ALWAYS_INLINE bool fit_seed_in_vectors(const MatchSet& m, std::uint32_t seed,
                                              const CompatibilitySettings& options,
                                              std::uint64_t random, Members& members,
                                              Pose<float>& pose) {
  const CompatibilityTest test = test_of(options);
  const float squared_distance = options.consensus_distance * options.consensus_distance;
  const float shortest = options.seed_separation * options.seed_separation;
  members.template gather<Mask>(m, seed, test, options.max_members);
  if (members.size < 3) return false;
  const MatchColumns columns(m);
  const std::uint32_t *match = members.match.data(), size = members.size;
  const std::uint32_t source = m.source[seed], target = m.target[seed];
  const Vec3 p0 = members.source(0), q0 = members.target(0);
  std::uint32_t best = 0;
  Vec3 p[3], q[3];
  for (std::uint32_t begin = 0; begin < options.triangles; begin += kBlock) {
    const std::uint32_t count = std::min(options.triangles - begin, kBlock);
    std::uint32_t first[kBlock], second[kBlock], kept[kBlock], keep = 0;
    for (std::uint32_t k = 0; k < kBlock; ++k) {
      const TrianglePick pick = pick_triangle(source, target, begin + k, random, size);
      first[k] = pick.a;
      second[k] = pick.b;
    }
    for (std::uint32_t k = 0; k < count; ++k) {
      const OrientedMatch a = columns[match[first[k]]], b = columns[match[second[k]]];
      kept[keep] = k;
      keep += compatible(a, b, test) & wide_triangle(p0, a.p, b.p, shortest);
    }
    for (std::uint32_t t = 0; t < keep; ++t) {
      const std::uint32_t k = kept[t];
      const Vec3 p1 = members.source(first[k]), p2 = members.source(second[k]);
      const Vec3 q1 = members.target(first[k]), q2 = members.target(second[k]);
      Rigid rigid;
      if (!carry_triangle(p0, p1, p2, q0, q1, q2, rigid)) continue;
      const std::uint32_t support = members.support(rigid, squared_distance, best);
      if (support <= best) continue;
      best = support;
      p[0] = p0;
      p[1] = p1;
      p[2] = p2;
      q[0] = q0;
      q[1] = q1;
      q[2] = q2;
    }
  }
  if (best == 0 || !fit_rigid(p, q, 3, pose)) return false;
  for (std::uint32_t k = 0; k < options.refits; ++k) {
    Pose<float> better = pose;
    if (!refit<Mask>(members, squared_distance, better)) break;
    pose = better;
  }
  return true;
}

#ifdef GPUREG_WIDE_TARGET
GPUREG_WIDE_TARGET bool fit_seed_wide(const MatchSet& m, std::uint32_t seed,
                                      const CompatibilitySettings& options, std::uint64_t random,
                                      Members& members, Pose<float>& pose) {
  return fit_seed_in_vectors<WideMask>(m, seed, options, random, members, pose);
}
#endif

bool fit_seed(const MatchSet& m, std::uint32_t seed, const CompatibilitySettings& options,
              std::uint64_t random, Members& members, Pose<float>& pose) {
#ifdef GPUREG_WIDE_TARGET
  if (has_wide_vectors()) return fit_seed_wide(m, seed, options, random, members, pose);
#endif
  return fit_seed_in_vectors<NarrowMask>(m, seed, options, random, members, pose);
}

GPUREG_ALWAYS_INLINE MatchEvidence count_in_vectors(const MatchSet& m, const Rigid& pose,
                                                    float squared_distance) {
  const float *px = m.px.data(), *py = m.py.data(), *pz = m.pz.data(), *qx = m.qx.data(),
              *qy = m.qy.data(), *qz = m.qz.data();
  const std::uint32_t *ws = m.source_weight.data(), *wt = m.target_weight.data();
  const std::uint32_t n = m.size();
  // Weights are at most 2^16, so this many sum up in 32 bits, which the processor adds eight at a
  // time.
  constexpr std::uint32_t kExactSum = 1u << 15;
  MatchEvidence total{0, 0, 0};
  for (std::uint32_t begin = 0; begin < n; begin += kExactSum) {
    const std::uint32_t end = std::min(n, begin + kExactSum);
    std::uint32_t inliers = 0, source = 0, target = 0;
    for (std::uint32_t k = begin; k < end; ++k) {
      const Vec3 d = apply(pose, {px[k], py[k], pz[k]}) - Vec3{qx[k], qy[k], qz[k]};
      const std::uint32_t take = squared_norm(d) < squared_distance ? ~0u : 0u;
      inliers += take & 1u;
      source += take & ws[k];
      target += take & wt[k];
    }
    total.inliers += inliers;
    total.source_weight += source;
    total.target_weight += target;
  }
  return total;
}

#ifdef GPUREG_WIDE_TARGET
GPUREG_WIDE_TARGET MatchEvidence count_wide(const MatchSet& m, const Rigid& pose,
                                            float squared_distance) {
  return count_in_vectors(m, pose, squared_distance);
}
#endif

}  // namespace

MatchEvidence count_matches(const MatchSet& m, const Rigid& pose, float squared_distance) {
#ifdef GPUREG_WIDE_TARGET
  if (has_wide_vectors()) return count_wide(m, pose, squared_distance);
#endif
  return count_in_vectors(m, pose, squared_distance);
}

std::vector<Candidates> propose_poses(Exec& exec, const std::vector<MatchSet>& matches,
                                      const std::vector<std::vector<std::uint32_t>>& seeds,
                                      const RegistrationSettings& options) {
  std::vector<Candidates> all(matches.size());
  std::vector<std::vector<std::uint8_t>> valid(matches.size());
  for (std::size_t p = 0; p < matches.size(); ++p) {
    all[p].pose.resize(seeds[p].size());
    all[p].matches.resize(seeds[p].size());
    valid[p].resize(seeds[p].size());
  }
  const float squared_distance =
      options.compatibility.consensus_distance * options.compatibility.consensus_distance;
  exec.parallel_items(
      matches.size(), [&](std::size_t p) { return seeds[p].size(); }, 32,
      [&](std::size_t p, std::size_t begin, std::size_t end) {
        Members members(options.compatibility.max_members);
        for (std::size_t k = begin; k < end; ++k) {
          valid[p][k] = fit_seed(matches[p], seeds[p][k], options.compatibility, options.seed,
                                 members, all[p].pose[k]);
          if (valid[p][k])
            all[p].matches[k] =
                count_matches(matches[p], to_rigid(all[p].pose[k]), squared_distance);
        }
      });
  std::vector<Candidates> out(matches.size());
  for (std::size_t p = 0; p < matches.size(); ++p)
    for (std::size_t k = 0; k < seeds[p].size(); ++k) {
      if (!valid[p][k]) continue;
      out[p].pose.push_back(all[p].pose[k]);
      out[p].matches.push_back(all[p].matches[k]);
      out[p].seed.push_back(seeds[p][k]);
    }
  return out;
}

}  // namespace gpureg::cpu
