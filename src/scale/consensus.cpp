// SPDX-License-Identifier: BSD-3-Clause
#include "scale/consensus.hpp"

#include <algorithm>
#include <array>
#include <cmath>

#include "algorithm/compatibility.hpp"
#include "math/philox.hpp"
#include "scale/fit_similarity.hpp"

namespace gpureg::scale {
namespace {

/// Matches that take part, and those of them that vote.
constexpr std::uint32_t kMatches = 2048, kVoters = 1024;
/// Ratios of distances that a rung looks at: features tolerate that much.
constexpr float kLeastRatio = 0.82f, kBin = 0.02f;
constexpr std::uint32_t kBins = 20;
/// Shortest distance of a pair of matches that votes, in voxels: its ratio is known to a fifth.
constexpr float kShortest = 6;
constexpr float kLargestTurn = 0.35f;  ///< of the cosines between normals
constexpr std::uint32_t kSeeds = 64, kTriangles = 64, kRefits = 3, kLeastInliers = 5;
constexpr float kConsensus = 2;  ///< voxels
constexpr float kPlace = 4;      ///< edge of a place, voxels

struct Columns {
  std::vector<float> px, py, pz, qx, qy, qz, mx, my, mz, nx, ny, nz;
  explicit Columns(const Matches& a, std::uint32_t count) {
    for (std::uint32_t k = 0; k < count; ++k) {
      px.push_back(a.p[k].x), py.push_back(a.p[k].y), pz.push_back(a.p[k].z);
      qx.push_back(a.q[k].x), qy.push_back(a.q[k].y), qz.push_back(a.q[k].z);
      mx.push_back(a.m[k].x), my.push_back(a.m[k].y), mz.push_back(a.m[k].z);
      nx.push_back(a.n[k].x), ny.push_back(a.n[k].y), nz.push_back(a.n[k].z);
    }
  }
};

/// Bins of the ratios of the distances between a match and the first `count` ones; kBins where the
/// pair does not vote. Without branches: vector instructions.
void bins_of(const Columns& c, std::uint32_t own, std::uint32_t count, float squared_shortest,
             std::uint32_t* out) {
  const float px = c.px[own], py = c.py[own], pz = c.pz[own], qx = c.qx[own], qy = c.qy[own],
              qz = c.qz[own], mx = c.mx[own], my = c.my[own], mz = c.mz[own], nx = c.nx[own],
              ny = c.ny[own], nz = c.nz[own];
  const float *cpx = c.px.data(), *cpy = c.py.data(), *cpz = c.pz.data(), *cqx = c.qx.data(),
              *cqy = c.qy.data(), *cqz = c.qz.data(), *cmx = c.mx.data(), *cmy = c.my.data(),
              *cmz = c.mz.data(), *cnx = c.nx.data(), *cny = c.ny.data(), *cnz = c.nz.data();
  for (std::uint32_t k = 0; k < count; ++k) {
    const float ax = cpx[k] - px, ay = cpy[k] - py, az = cpz[k] - pz;
    const float bx = cqx[k] - qx, by = cqy[k] - qy, bz = cqz[k] - qz;
    const float a = ax * ax + ay * ay + az * az, b = bx * bx + by * by + bz * bz;
    const float turn =
        (cmx[k] * mx + cmy[k] * my + cmz[k] * mz) - (cnx[k] * nx + cny[k] * ny + cnz[k] * nz);
    const float place = (std::sqrt(b / std::max(a, squared_shortest)) - kLeastRatio) * (1 / kBin);
    const bool votes = (a > squared_shortest) & (b > squared_shortest) & (turn < kLargestTurn) &
                       (turn > -kLargestTurn) & (place >= 0) & (place < static_cast<float>(kBins));
    out[k] = votes ? static_cast<std::uint32_t>(static_cast<std::int32_t>(place)) : kBins;
  }
}

struct Seed {
  std::uint32_t match, votes, bin;
};

/// The matches with the most votes for two neighbouring bins of ratios.
std::vector<Seed> seeds_of(const Columns& c, std::uint32_t count, float squared_shortest) {
  const std::uint32_t voters = std::min(count, kVoters);
  std::vector<std::uint32_t> bin(voters);
  std::vector<Seed> seeds;
  for (std::uint32_t own = 0; own < count; ++own) {
    bins_of(c, own, voters, squared_shortest, bin.data());
    std::array<std::uint32_t, kBins + 1> votes{};
    for (std::uint32_t k = 0; k < voters; ++k) ++votes[bin[k]];
    Seed seed{own, 0, 0};
    for (std::uint32_t b = 0; b + 1 < kBins; ++b)
      if (const std::uint32_t sum = votes[b] + votes[b + 1]; sum > seed.votes) seed = {own, sum, b};
    seeds.push_back(seed);
  }
  std::sort(seeds.begin(), seeds.end(), [](const Seed& a, const Seed& b) {
    return a.votes != b.votes ? a.votes > b.votes : a.match < b.match;
  });
  if (seeds.size() > kSeeds) seeds.resize(kSeeds);
  return seeds;
}

std::uint32_t places_of(std::vector<std::array<std::int32_t, 3>>& cells) {
  std::sort(cells.begin(), cells.end());
  return static_cast<std::uint32_t>(std::unique(cells.begin(), cells.end()) - cells.begin());
}

std::array<std::int32_t, 3> cell_of(Vec3 p, float inverse) {
  return {static_cast<std::int32_t>(std::floor(p.x * inverse)),
          static_cast<std::int32_t>(std::floor(p.y * inverse)),
          static_cast<std::int32_t>(std::floor(p.z * inverse))};
}

class Fitter {
 public:
  Fitter(const Matches& matches, std::uint32_t count, float voxel)
      : matches_(matches),
        count_(count),
        squared_(kConsensus * kConsensus * voxel * voxel),
        inverse_place_(1 / (kPlace * voxel)) {}

  bool agrees(const Rigid& motion, std::uint32_t k) const {
    return squared_norm(apply(motion, matches_.p[k]) - matches_.q[k]) < squared_;
  }
  bool fit(const std::vector<std::uint32_t>& of, Similarity& out) {
    p_.clear();
    q_.clear();
    for (const std::uint32_t k : of) {
      p_.push_back(matches_.p[k]);
      q_.push_back(matches_.q[k]);
    }
    return fit_similarity(p_.data(), q_.data(), static_cast<int>(of.size()), out);
  }
  /// Refits to all matches that agree, and counts their places.
  Proposal refit(Similarity motion) {
    std::vector<std::uint32_t> inliers;
    for (std::uint32_t round = 0; round <= kRefits; ++round) {
      inliers.clear();
      for (std::uint32_t k = 0; k < count_; ++k)
        if (agrees(motion.rigid, k)) inliers.push_back(k);
      if (round == kRefits || inliers.size() < kLeastInliers) break;
      if (!fit(inliers, motion)) return {};
    }
    if (inliers.size() < kLeastInliers) return {};
    std::vector<std::array<std::int32_t, 3>> source, target;
    for (const std::uint32_t k : inliers) {
      source.push_back(cell_of(matches_.p[k] * motion.scale, inverse_place_));
      target.push_back(cell_of(matches_.q[k], inverse_place_));
    }
    return {static_cast<double>(motion.scale), std::min(places_of(source), places_of(target))};
  }

 private:
  const Matches& matches_;
  std::uint32_t count_;
  float squared_, inverse_place_;
  std::vector<Vec3> p_, q_;
};

}  // namespace

std::vector<Proposal> propose_factors(const Matches& matches, float voxel, std::uint64_t seed) {
  const std::uint32_t count = std::min(matches.size(), kMatches);
  const float squared_shortest = kShortest * kShortest * voxel * voxel;
  const Columns columns(matches, count);
  Fitter fitter(matches, count, voxel);
  std::vector<std::uint32_t> bin(count);
  std::vector<Proposal> out;
  for (const Seed& s : seeds_of(columns, count, squared_shortest)) {
    if (s.votes < kLeastInliers) break;
    bins_of(columns, s.match, count, squared_shortest, bin.data());
    std::vector<std::uint32_t> members;
    for (std::uint32_t k = 0; k < count; ++k)
      if (bin[k] == s.bin || bin[k] == s.bin + 1) members.push_back(k);
    const auto size = static_cast<std::uint32_t>(members.size());
    Similarity best{};
    std::uint32_t most = 0;
    for (std::uint32_t t = 0; t < kTriangles; ++t) {
      const PhiloxWords w = philox(s.match, t, 0, kTagTriangle, static_cast<std::uint32_t>(seed),
                                   static_cast<std::uint32_t>(seed >> 32));
      const std::uint32_t a = members[scale_to(w.v[0], size)], b = members[scale_to(w.v[1], size)];
      if (a == b) continue;
      const float of_source = squared_norm(matches.p[a] - matches.p[b]),
                  of_target = squared_norm(matches.q[a] - matches.q[b]);
      if (!(of_source > squared_shortest)) continue;
      const float side = std::sqrt(of_target / of_source),
                  voted = kLeastRatio + kBin * static_cast<float>(s.bin + 1);
      if (!(std::abs(side - voted) < 3 * kBin)) continue;
      Similarity motion;
      if (!fitter.fit({s.match, a, b}, motion)) continue;
      std::uint32_t agreeing = 0;
      for (const std::uint32_t k : members) agreeing += fitter.agrees(motion.rigid, k);
      if (agreeing > most) {
        most = agreeing;
        best = motion;
      }
    }
    if (most < kLeastInliers) continue;
    const Proposal proposal = fitter.refit(best);
    if (proposal.places > 0) out.push_back(proposal);
  }
  std::stable_sort(out.begin(), out.end(),
                   [](const Proposal& a, const Proposal& b) { return a.places > b.places; });
  return out;
}

}  // namespace gpureg::scale
