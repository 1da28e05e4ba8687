// SPDX-License-Identifier: BSD-3-Clause
#include "localization/verify_places.hpp"

#include <algorithm>
#include <cmath>

#include "fields/localization.hpp"
#include "fields/scale.hpp"
#include "math/exponential.hpp"

namespace gpureg::localization {
namespace {

/// The evidence of a pair may overlap little, but a scan that is in the map lies in it, and sees
/// what the map has there. Log odds that a place loses: with the part of the scan beyond a tenth
/// that has no surface of the map beside it,
constexpr double kContained = 0.9, kLogOddsOfRest = 8;
/// with the part of the map that lies in free space of the scan, and with the parts of both in
/// front of surfaces of the other, beyond what right places have; at most so many, as rooms change.
constexpr double kInFreeSpace = 0.005, kLogOddsInFreeSpace = 150;
constexpr double kInFront = 0.01, kLogOddsInFront = 100;
constexpr double kMostLogOdds = 4;

/// Log odds against a place. Sparse scans are contained in wide voxels at least.
double doubt(const PoseVerification& fine, const PoseVerification& wide) {
  const PoseEvidence& e = fine.evidence;
  const double contained =
      std::max(e.source_overlap_any_normal, wide.evidence.source_overlap_any_normal);
  const auto beyond = [](double share, double usual) { return std::max(0.0, share - usual); };
  const double contradicted =
      kLogOddsInFreeSpace * beyond(e.target_free_space_violation, kInFreeSpace) +
      kLogOddsInFront * (beyond(e.source_front_violation_near, kInFront) +
                         beyond(e.target_front_violation_near, kInFront));
  return kLogOddsOfRest * beyond(kContained, contained) + std::min(kMostLogOdds, contradicted);
}

/// The mean of the log odds of the search and the verification, where it is more than that of the
/// verification alone, less the doubt.
double confidence_of(double searched, const PoseVerification& fine, const PoseVerification& wide) {
  const double verified = odds_of(std::max(fine.confidence, wide.confidence));
  const double odds = std::max(verified, std::sqrt(odds_of(searched) * verified)) *
                      portable::exp(-doubt(fine, wide));
  return odds / (1 + odds);
}

/// Sparse scans overlap little in narrow voxels: what is not sure there and possible in the wide
/// ones of the search is verified in these, too. @return confidences of 0 where it is not.
std::vector<PoseVerification> verify_coarsely(const Context& context, const MapState& map,
                                              const LocateOptions& options, const Scan& scan,
                                              const std::vector<const Verified*>& fine,
                                              const std::vector<PointCloud>& around) {
  std::vector<PoseVerification> out(fine.size());
  if (options.coarse_factor == 1 || !scan.coarse.valid()) return out;
  std::vector<std::size_t> asked;
  std::vector<PointCloudView> neighborhoods;
  std::vector<Pair> pairs;
  std::vector<std::vector<UnalignedIsometry3d>> poses;
  for (std::size_t k = 0; k < fine.size(); ++k) {
    const PoseVerification& found = fine[k]->verification;
    if (found.confidence >= kSure || fine[k]->candidate.confidence < kHopelessSearch) continue;
    asked.push_back(k);
    neighborhoods.push_back(around[k].view());
    pairs.push_back({0, static_cast<std::uint32_t>(asked.size())});
    poses.push_back({found.target_from_source});
  }
  if (asked.empty()) return out;
  std::vector<PreparedCloud> clouds{scan.coarse};
  for (PreparedCloud& cloud :
       prepare_batch(context, neighborhoods, prepare_for(map, options.coarse_factor)))
    clouds.push_back(std::move(cloud));
  RegistrationOptions registration = options.registration;
  fields::multiply_lengths(registration, options.coarse_factor);
  VerificationOptions verification;
  verification.refine = true;
  const auto results =
      verify_poses_batch(context, clouds, pairs, poses, registration, verification);
  for (std::size_t k = 0; k < asked.size(); ++k) out[asked[k]] = results[k].front();
  return out;
}

}  // namespace

std::vector<Verified> verify_places(const Context& context, const MapState& map,
                                    const LocateOptions& options, const Scan& scan,
                                    const std::vector<Verified>& before) {
  std::vector<PointCloud> around;
  std::vector<Pair> pairs;
  std::vector<std::vector<UnalignedIsometry3d>> poses;
  std::vector<Verified> out;
  std::vector<std::size_t> open;
  for (const Candidate& candidate : scan.candidates) {
    const auto known = std::find_if(before.begin(), before.end(), [&](const Verified& v) {
      return v.candidate.map_from_scan.matrix() == candidate.map_from_scan.matrix();
    });
    out.push_back(known == before.end() ? Verified{candidate, {}, 0, 0} : *known);
    if (known != before.end()) continue;
    open.push_back(out.size() - 1);
    around.push_back(neighborhood(map, scan.points, candidate.map_from_scan, options.neighborhood));
    pairs.push_back({0, static_cast<std::uint32_t>(around.size())});
    poses.push_back({candidate.map_from_scan});
  }
  std::vector<PreparedCloud> clouds{scan.cloud};
  for (PreparedCloud& cloud :
       prepare_batch(context, views_of(around), as_they_are(map.options.prepare)))
    clouds.push_back(std::move(cloud));
  VerificationOptions verification;
  verification.refine = true;
  const auto results =
      verify_poses_batch(context, clouds, pairs, poses, options.registration, verification);
  std::vector<const Verified*> fine;
  for (std::size_t k = 0; k < results.size(); ++k) {
    Verified& v = out[open[k]];
    v.verification = results[k].front();
    v.points = clouds[k + 1].size();
    fine.push_back(&v);
  }
  const auto coarse = verify_coarsely(context, map, options, scan, fine, around);
  for (std::size_t k = 0; k < results.size(); ++k) {
    Verified& v = out[open[k]];
    v.confidence = confidence_of(v.candidate.confidence, v.verification, coarse[k]);
  }
  std::stable_sort(out.begin(), out.end(), [](const Verified& a, const Verified& b) {
    return a.confidence > b.confidence;
  });
  return out;
}

}  // namespace gpureg::localization
