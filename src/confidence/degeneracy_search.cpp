// SPDX-License-Identifier: BSD-3-Clause
#include "confidence/degeneracy_search.hpp"

#include <algorithm>
#include <iterator>

#include "common/host_threads.hpp"
#include "confidence/confidence.hpp"
#include "confidence/pose_evidence.hpp"

namespace gpureg::confidence {
namespace {

/// Rotated about the centre of the inliers, then shifted, along the weakest direction.
Pose<double> moved_along(const InformationSpectrum& spectrum, const Pose<double>& pose,
                         double distance) {
  const Eigen::Vector3d turn = spectrum.weakest_direction.head<3>() * (distance / spectrum.unit);
  const Eigen::Vector3d still = Eigen::Vector3d::Zero();
  double r[9];
  rotation_matrix(compose_small(turn.data(), still.data(), identity_pose<double>()), r);
  const Eigen::Vector3d turned =
      Eigen::Map<const Eigen::Matrix<double, 3, 3, Eigen::RowMajor>>(r) * spectrum.centre;
  const Eigen::Vector3d shift =
      spectrum.centre - turned + spectrum.weakest_direction.tail<3>() * distance;
  return compose_small(turn.data(), shift.data(), pose);
}

/// Log odds of the most likely mode below which no perturbed pose was ever the correct one, and
/// above which only the confidence may change. Other limits find as much (bench/notes/accuracy.md);
/// these need the fewest poses.
constexpr double kHopelessLogOdds = -5, kConfidentLogOdds = 3;

/// Distances as fractions of evidence.degeneracy_search_distance. Near the truth refinement stops
/// at places 10 to 20 cm apart at the default voxel size, hence steps of a quarter. A confident
/// mode is only tested for another stable pose at the full distance, unless it is on a model: there
/// the log odds do not tell a pose from one a voxel away (fits_model_better()).
Span<const double> fractions_for(double log_odds, bool model) {
  static constexpr double kFractions[] = {1, 0.75, 0.5, 0.25};
  static_assert(2 * std::size(kFractions) == limits::kMaxPerturbedPoses, "both ways");
  const std::size_t count = log_odds < kHopelessLogOdds             ? 0
                            : model || log_odds < kConfidentLogOdds ? std::size(kFractions)
                                                                    : 1;
  return {kFractions, count};
}

/// Whether a pose has returned to the mode, by the source points in correspondences under it. On a
/// model none has: the one that fits best may be half a voxel away (fits_model_better()).
ReturnTest return_test(const ModeOutcome& mode, const PreparedState& source, bool model,
                       const RegistrationSettings& options) {
  ReturnTest test{};
  test.origin = mode.pose;
  test.squared_distance = -1.0;
  const Moments& m = mode.source_moments;
  if (model || m.count == 0) return test;
  const double radius = static_cast<double>(source.radius),
               unit =
                   radius / (static_cast<double>(kMomentFixedScale) * static_cast<double>(m.count)),
               limit = static_cast<double>(kReturned) *
                       static_cast<double>(options.prepare.max_correspondence_distance);
  for (int k = 0; k < 3; ++k) test.mean[k] = static_cast<double>(m.sum[k]) * unit;
  for (int k = 0; k < 6; ++k) test.outer[k] = static_cast<double>(m.outer[k]) * (unit * radius);
  test.squared_distance = limit * limit;
  return test;
}

PosesOfPair perturb(const PairInput& pair, const PairOutcome& outcome,
                    const RegistrationSettings& options) {
  const double distance = static_cast<double>(options.evidence.degeneracy_search_distance);
  PosesOfPair out;
  std::vector<PoseEvidence> evidence;
  std::vector<const ModeOutcome*> modes;
  for (const ModeOutcome& mode : outcome.modes) {
    // A pose that the prior forbids is not reported.
    if (!permitted(pair.prior, to_rigid(mode.pose))) continue;
    if (planar_pair(*pair.source, *pair.target) && without_overlap(mode)) continue;
    modes.push_back(&mode);
  }
  if (modes.empty()) return out;
  const std::vector<InformationSpectrum> spectra = spectra_of(modes, *pair.source, *pair.target);
  for (std::size_t k = 0; k < modes.size(); ++k)
    evidence.push_back(
        evidence_of(outcome, *modes[k], spectra[k], *pair.source, *pair.target, false));
  const Ranking ranking = ranking_of(evidence, *pair.source, *pair.target);
  const std::size_t best = ranking.order.front();
  const ModeOutcome& mode = *modes[best];
  const InformationSpectrum& spectrum = spectra[best];
  out.origin_mode = mode.origin_mode;
  out.returned = return_test(mode, *pair.source, ranking.available.model, options);
  for (const double fraction : fractions_for(ranking.log_odds[best], ranking.available.model))
    for (const double step : {fraction * distance, -fraction * distance})
      out.poses.push_back(moved_along(spectrum, mode.pose, step));
  return out;
}

}  // namespace

std::vector<PosesOfPair> search_degeneracies(Span<const PairInput> pairs,
                                             Span<const PairOutcome> outcomes,
                                             const RegistrationSettings& options,
                                             std::size_t threads) {
  std::vector<PosesOfPair> out(pairs.size);
  if (options.evidence.degeneracy_search_distance == 0.0f) return out;
  // A thread for fewer pairs costs more than it saves.
  constexpr std::size_t kPairsPerThread = 16;
  const std::size_t workers = std::min(threads, 1 + pairs.size / kPairsPerThread);
  on_threads(workers, [&](std::size_t worker) {
    for (std::size_t p = worker; p < pairs.size; p += workers)
      out[p] = perturb(pairs.data[p], outcomes.data[p], options);
  });
  return out;
}

}  // namespace gpureg::confidence
