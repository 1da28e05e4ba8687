// SPDX-License-Identifier: BSD-3-Clause
#include "api/slide.hpp"

#include <iterator>

#include "api/confidence.hpp"
#include "api/evidence.hpp"

namespace gpureg {
namespace {

/// Moved along the softest direction: turned about the centre of the inliers, then shifted.
Pose<double> moved_along(const InformationSpectrum& spectrum, const Pose<double>& pose,
                         double distance) {
  const Eigen::Vector3d turn = spectrum.softest.head<3>() * (distance / spectrum.unit);
  const Eigen::Vector3d still = Eigen::Vector3d::Zero();
  double r[9];
  rotation_matrix(compose_small(turn.data(), still.data(), Pose<double>{1, 0, 0, 0, 0, 0, 0}), r);
  const Eigen::Vector3d turned =
      Eigen::Map<const Eigen::Matrix<double, 3, 3, Eigen::RowMajor>>(r) * spectrum.centre;
  const Eigen::Vector3d shift = spectrum.centre - turned + spectrum.softest.tail<3>() * distance;
  return compose_small(turn.data(), shift.data(), pose);
}

/// Log odds of the likeliest mode below which there is nothing to be found beside it, and above
/// which it is at most too sure. Other bands find as much (docs/accuracy.md); these cost the fewest
/// poses.
constexpr double kHopeless = -5, kSure = 3;

/// How far to look, as shares of evidence.slide_distance. Near the truth refinement stops at
/// several places, 10 to 20 cm apart at the usual voxels, so an open question is asked at steps of
/// a quarter. What is sure is only asked whether it would stay elsewhere, too.
Span<const double> ways_of(double log_odds) {
  static constexpr double kWays[] = {1, 0.75, 0.5, 0.25};
  static_assert(2 * std::size(kWays) == kMostFurtherPoses, "both ways");
  return {kWays, log_odds < kHopeless ? 0u : log_odds < kSure ? std::size(kWays) : 1u};
}

}  // namespace

FurtherPoses slide(const PairInput& pair, const PairOutcome& outcome,
                   const RegistrationOptions& options) {
  FurtherPoses out{0, {}};
  const double distance = static_cast<double>(options.evidence.slide_distance);
  if (distance == 0.0) return out;
  std::vector<PoseEvidence> evidence;
  std::vector<const ModeOutcome*> modes;
  for (const ModeOutcome& mode : outcome.modes) {
    // What the prior forbids will not be reported.
    if (!permitted(pair.prior, to_rigid(mode.pose))) continue;
    evidence.push_back(to_evidence(outcome, mode, *pair.source, *pair.target, false));
    modes.push_back(&mode);
  }
  if (modes.empty()) return out;
  const auto [number, log_odds] = likeliest_of(evidence);
  const ModeOutcome& likeliest = *modes[number];
  const InformationSpectrum spectrum = spectrum_of(likeliest, *pair.source);
  out.family = likeliest.family;
  for (const double share : ways_of(log_odds))
    for (const double way : {share * distance, -share * distance})
      out.poses.push_back(moved_along(spectrum, likeliest.pose, way));
  return out;
}

}  // namespace gpureg
