// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>

#include "algorithm/fit.hpp"
#include "cpu/compatibility.hpp"
#include "cpu/stages.hpp"
#include "cpu/wide_vectors.hpp"

namespace gpureg::cpu {
namespace {

/// Neighbourhood of a seed: the seed, then the first of its compatible matches.
struct Members {
  std::vector<float> px, py, pz, qx, qy, qz;
  static constexpr std::uint32_t kBlock = 64;

  std::vector<std::uint32_t> weight, match;
  std::vector<std::uint32_t> remaining;  ///< weight of each block of members and of all after it
  std::uint32_t size = 0;

  explicit Members(std::uint32_t most) {
    for (auto* v : {&px, &py, &pz, &qx, &qy, &qz}) v->resize(most);
    weight.resize(most);
    match.resize(most);
    remaining.resize(most / kBlock + 1);
  }
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
  void gather(const MatchSet& m, std::uint32_t seed, const CompatibilityTest& test,
              std::uint32_t most) {
    size = 0;
    add(m, seed);
    for_each_compatible(m, seed, test, [&](std::uint32_t k) {
      if (k != seed && size < most) add(m, k);
      return size < most;
    });
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
  std::uint32_t support(const Rigid& pose, float squared_distance, std::uint32_t best) const {
#ifdef GPUREG_WIDE_TARGET
    if (has_wide_vectors()) return support_wide(pose, squared_distance, best);
#endif
    return support_in_vectors(pose, squared_distance, best);
  }

 private:
#ifdef GPUREG_WIDE_TARGET
  GPUREG_WIDE_TARGET std::uint32_t support_wide(const Rigid& pose, float squared_distance,
                                                std::uint32_t best) const {
    return support_in_vectors(pose, squared_distance, best);
  }
#endif
  GPUREG_ALWAYS_INLINE std::uint32_t support_in_vectors(const Rigid& pose, float squared_distance,
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
};

/// Least-squares fit to the members that the pose aligns; false where they do not determine a pose.
bool refit(const Members& members, float squared_distance, Pose<float>& pose) {
  const Rigid rigid = to_rigid(pose);
  Vec3 p[limits::kMaxMembers], q[limits::kMaxMembers];
  int n = 0;
  for (std::uint32_t k = 0; k < members.size; ++k)
    if (squared_norm(apply(rigid, members.source(k)) - members.target(k)) < squared_distance) {
      p[n] = members.source(k);
      q[n] = members.target(k);
      ++n;
    }
  return fit_rigid(p, q, n, pose);
}

/// The triangle of the seed and two compatible members with the largest consensus weight, refitted
/// to its consensus set.
bool fit_seed(const MatchSet& m, std::uint32_t seed, const CompatibilityOptions& options,
              std::uint64_t random, Members& members, Pose<float>& pose) {
  const CompatibilityTest test = test_of(options);
  const float squared_distance = options.consensus_distance * options.consensus_distance;
  const float shortest = options.seed_separation * options.seed_separation;
  members.gather(m, seed, test, options.max_members);
  if (members.size < 3) return false;
  const MatchColumns columns(m);
  std::uint32_t best = 0;
  Vec3 p[3], q[3];
  for (std::uint32_t trial = 0; trial < options.triangles; ++trial) {
    const TrianglePick pick =
        pick_triangle(m.source[seed], m.target[seed], trial, random, members.size);
    if (!compatible(columns[members.match[pick.a]], columns[members.match[pick.b]], test)) continue;
    const Vec3 p0 = members.source(0), p1 = members.source(pick.a), p2 = members.source(pick.b);
    const Vec3 q0 = members.target(0), q1 = members.target(pick.a), q2 = members.target(pick.b);
    Rigid rigid;
    if (!wide_triangle(p0, p1, p2, shortest) || !carry_triangle(p0, p1, p2, q0, q1, q2, rigid))
      continue;
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
  if (best == 0 || !fit_rigid(p, q, 3, pose)) return false;
  for (std::uint32_t k = 0; k < options.refits; ++k) {
    Pose<float> better = pose;
    if (!refit(members, squared_distance, better)) break;
    pose = better;
  }
  return true;
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
                                      const RegistrationOptions& options) {
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
