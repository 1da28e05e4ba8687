// SPDX-License-Identifier: BSD-3-Clause
#include "reconstruction/audit/common_shift.hpp"

#include <algorithm>
#include <cmath>

namespace gpureg::reconstruction {
namespace {

/// Motions that are tried: of so many pairs.
constexpr std::size_t kMostTried = 16;
/// Of the pairs, so many move by the common motion, and together they say so much: more than the
/// six numbers of a motion fit to noise.
constexpr double kLeastShare = 0.7, kLeastSum = -8;
/// What one pair says at most.
constexpr double kMostOfPair = 2;

/// What a pair says of a motion of one part, in the frame of the map.
struct Vote {
  UnalignedIsometry3d motion;  ///< that ICP asks for
  Eigen::Vector3d centre;      ///< of the overlap
  Eigen::Matrix3d spread;      ///< its covariance
  double shift = 0;            ///< squared, mean over the overlap
};

/// Mean squared distance between the overlap moved by either motion.
double distance(const Vote& vote, const UnalignedIsometry3d& other) {
  const Eigen::Matrix3d turn = vote.motion.linear() - other.linear();
  return (vote.motion * vote.centre - other * vote.centre).squaredNorm() +
         std::max(0.0, (turn * vote.spread * turn.transpose()).trace());
}

Vote vote_of(const AuditedPair& pair, bool source_moves,
             const std::vector<UnalignedIsometry3d>& world_from_scan) {
  const UnalignedIsometry3d &source = world_from_scan[pair.source],
                            &target = world_from_scan[pair.target];
  Vote vote;
  vote.motion = source_moves ? target * pair.refined * source.inverse()
                             : source * pair.refined.inverse() * target.inverse();
  vote.centre = source * pair.overlap_centre;
  vote.spread = source.linear() * pair.overlap_spread * source.linear().transpose();
  vote.shift = distance(vote, UnalignedIsometry3d::Identity());
  return vote;
}

}  // namespace

std::vector<double> common_shift(const std::vector<AuditedPair>& pairs,
                                 const std::vector<std::size_t>& across, const ScansBelow& below,
                                 const std::vector<UnalignedIsometry3d>& world_from_scan,
                                 double noise) {
  std::vector<Vote> votes;
  std::vector<std::size_t> moved;
  for (const std::size_t k : across) {
    votes.push_back(vote_of(pairs[k], below(pairs[k].source), world_from_scan));
    if (votes.back().shift > noise * noise) moved.push_back(votes.size() - 1);
  }
  if (static_cast<double>(moved.size()) < kLeastShare * static_cast<double>(votes.size()))
    return {};
  std::vector<double> best, says(votes.size());
  double best_sum = kLeastSum;
  const std::size_t step = std::max<std::size_t>(1, moved.size() / kMostTried);
  for (std::size_t m = 0; m < moved.size(); m += step) {
    const UnalignedIsometry3d& motion = votes[moved[m]].motion;
    double sum = 0;
    std::size_t with = 0;
    for (std::size_t k = 0; k < votes.size(); ++k) {
      const double left = distance(votes[k], motion);
      // The pair whose motion is tried says nothing of it.
      says[k] = k == moved[m] ? 0
                              : std::clamp((left - votes[k].shift) / (2 * noise * noise),
                                           -kMostOfPair, kMostOfPair);
      sum += says[k];
      with += 4 * left < votes[k].shift;
    }
    if (sum >= best_sum ||
        static_cast<double>(with) < kLeastShare * static_cast<double>(votes.size()))
      continue;
    best_sum = sum;
    best = says;
  }
  return best;
}

}  // namespace gpureg::reconstruction
