// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <cmath>

#include "fields/localization.hpp"
#include "fields/scale.hpp"
#include "localization/check_scan.hpp"
#include "localization/search.hpp"
#include "math/exponential.hpp"

namespace gpureg::localization {
namespace {

/// Confidence of a place from which the coarse search is enough, and one of its poses, not verified
/// yet, that a search in narrower voxels hardly surpasses.
constexpr double kSure = 0.75, kSureSearch = 0.95;
/// Where no pose of the coarse search reaches this confidence, the scan is not in the map, if its
/// coarse points are so many that the search had something to see.
constexpr double kHopelessSearch = 0.1;

/// The evidence of a pair may overlap little, but a scan that is in the map lies in it, and sees
/// what the map has there. Log odds that a place loses: with the part of the scan beyond a tenth
/// that has no surface of the map beside it,
constexpr double kContained = 0.9, kLogOddsOfRest = 8;
/// with the part of the map that lies in free space of the scan, and with the parts of both in
/// front of surfaces of the other, beyond what right places have; at most so many, as rooms change.
constexpr double kInFreeSpace = 0.005, kLogOddsInFreeSpace = 150;
constexpr double kInFront = 0.01, kLogOddsInFront = 100;
constexpr double kMostLogOdds = 4;

/// A candidate in all of the map around it.
struct Verified {
  Candidate candidate;
  PoseVerification verification;
  std::size_t points = 0;  ///< of the neighbourhood
  double confidence = 0;   ///< other places aside
};

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
  if (options.coarse_factor == 1) return out;
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

/// @param before candidates of the scan that were verified already.
std::vector<Verified> verify(const Context& context, const MapState& map,
                             const LocateOptions& options, const Scan& scan,
                             const std::vector<Verified>& before = {}) {
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

double best_searched(const Scan& scan) {
  return scan.candidates.empty() ? 0 : scan.candidates.front().confidence;
}

LocateStatus status_of(const LocateResult& result, double min_confidence) {
  if (result.poses.empty()) return LocateStatus::not_found;
  double together = result.poses.front().confidence;
  if (together >= min_confidence) return LocateStatus::found;
  bool several = false;
  for (const LocatedPose& pose : result.poses)
    if (pose.alias) {
      together += pose.confidence;
      several = true;
    }
  return several && together >= min_confidence ? LocateStatus::ambiguous : LocateStatus::not_found;
}

LocateResult result_of(const std::vector<Verified>& verified, const Scan& scan,
                       const LocateOptions& options) {
  LocateResult out;
  out.scan_points = scan.points.size();
  out.tiles = scan.tiles;
  std::vector<double> alone;
  for (const Verified& v : verified) {
    const UnalignedIsometry3d& pose = v.verification.target_from_source;
    if (contradicts(scan, pose) ||
        std::any_of(out.poses.begin(), out.poses.end(), [&](const LocatedPose& kept) {
          return same_place(kept.map_from_scan, pose, scan.middle, options.registration.evidence);
        }))
      continue;
    if (out.poses.empty()) out.neighborhood_points = v.points;
    LocatedPose place;
    place.map_from_scan = pose;
    place.verification = v.verification;
    place.alias = !out.poses.empty() && v.confidence >= options.registration.min_confidence;
    out.poses.push_back(place);
    alone.push_back(v.confidence);
  }
  const std::vector<double> shared = shared_probability(alone);
  for (std::size_t k = 0; k < out.poses.size(); ++k) out.poses[k].confidence = shared[k];
  out.absent_probability = shared.back();
  out.status = status_of(out, options.registration.min_confidence);
  return out;
}

void check(const MapState& map, const LocateOptions& options, std::size_t scans,
           const std::vector<LocatePrior>& priors, const std::vector<std::string>& names) {
  options.validate();
  const auto fits = [&](std::size_t count, const char* what) {
    if (count != 0 && count != scans)
      throw InvalidArgument(std::string(what) + " has " + std::to_string(count) +
                            " entries, but scans has " + std::to_string(scans));
  };
  fits(priors.size(), "priors");
  fits(names.size(), "names");
  for (std::size_t k = 0; k < priors.size(); ++k)
    priors[k].validate("priors[" + std::to_string(k) + "]");
  const float of_map = map.options.prepare.voxel_size,
              of_options = options.registration.prepare.voxel_size;
  if (of_map != of_options)
    throw InvalidArgument("registration.prepare.voxel_size is " + std::to_string(of_options) +
                          ", but the map was made with " + std::to_string(of_map));
}

}  // namespace

std::vector<LocateResult> locate(const Context& context, const std::vector<PointCloudView>& scans,
                                 const PreparedMap& map, const LocateOptions& options,
                                 const std::vector<LocatePrior>& priors,
                                 const std::vector<std::string>& names) {
  const MapState& state = MapState::of(map);
  check(state, options, scans.size(), priors, names);
  for (std::size_t k = 0; k < scans.size(); ++k) {
    scans[k].validate();
    check_unit(scans[k], state, names.empty() ? "scans[" + std::to_string(k) + "]" : names[k]);
  }
  const std::vector<PreparedCloud> prepared =
      prepare_batch(context, scans, state.options.prepare, names);
  const bool coarse_first = options.coarse_factor > 1;
  const auto thinned = [&](double factor) {
    return prepare_batch(context, scans, prepare_for(state, factor), names);
  };
  const std::vector<PreparedCloud> coarse =
      coarse_first ? thinned(options.coarse_factor) : prepared;
  const double factor = coarsest_factor(state, options);
  const std::vector<PreparedCloud> coarsest =
      factor > 0 ? thinned(factor) : std::vector<PreparedCloud>(scans.size());
  std::vector<Scan> found;
  for (std::size_t k = 0; k < scans.size(); ++k)
    found.push_back(
        scan_of(prepared[k], coarse[k], coarsest[k], priors.empty() ? LocatePrior{} : priors[k]));
  search_all_tiles(context, state, options, found);
  std::vector<LocateResult> out;
  std::vector<std::vector<Verified>> verified;
  std::vector<std::size_t> unsure;
  for (std::size_t k = 0; k < found.size(); ++k) {
    const double searched = best_searched(found[k]);
    const bool hopeless =
        coarse_first && searched < kHopelessSearch && found[k].coarse.size() >= kTellingPoints;
    if (hopeless && !found[k].candidates.empty()) found[k].candidates.resize(1);
    verified.push_back(verify(context, state, options, found[k]));
    out.push_back(result_of(verified[k], found[k], options));
    const bool sure = !out[k].poses.empty() && out[k].poses.front().confidence >= kSure;
    if (coarse_first && !hopeless && !sure && searched < kSureSearch) unsure.push_back(k);
  }
  if (unsure.empty()) return out;
  search_best_tiles(context, state, options, unsure, found);
  for (const std::size_t k : unsure)
    out[k] = result_of(verify(context, state, options, found[k], verified[k]), found[k], options);
  return out;
}

LocateResult locate(const Context& context, const PointCloudView& scan, const PreparedMap& map,
                    const LocatePrior& prior) {
  const float voxel_size = map.options().prepare.voxel_size;
  return locate(context, {scan}, map, LocateOptions::from_voxel_size(voxel_size), {prior}).front();
}

}  // namespace gpureg::localization
