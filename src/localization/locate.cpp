// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <cmath>

#include "localization/candidates.hpp"
#include "localization/check_scan.hpp"

namespace gpureg::localization {
namespace {

/// Prepared points of the tiles that are aligned together: about 1 GB.
constexpr std::size_t kPointsAtOnce = 400'000;
/// Poses that a tile finds less likely than this are left out, but for the first one.
constexpr double kHopeless = 1e-4;

/// A scan on its way through the map.
struct Scan {
  PreparedCloud cloud;
  std::vector<Eigen::Vector3d> points;  ///< in the scan's frame
  Eigen::Vector3d middle{0, 0, 0};
  double reach = 0;  ///< largest distance of a point from the origin of the frame
  LocatePrior prior;
  std::size_t tiles = 0;
  std::vector<Candidate> candidates;
};

Scan scan_of(PreparedCloud cloud, const LocatePrior& prior) {
  Scan scan;
  for (const Eigen::Vector3f& point : cloud.points()) {
    scan.points.push_back(point.cast<double>() + cloud.origin());
    scan.middle += scan.points.back();
    scan.reach = std::max(scan.reach, scan.points.back().norm());
  }
  if (!scan.points.empty()) scan.middle /= static_cast<double>(scan.points.size());
  scan.cloud = std::move(cloud);
  scan.prior = prior;
  return scan;
}

bool may_be_in(const Scan& scan, const MapState& map, std::size_t tile) {
  if (!scan.prior.position) return true;
  const Eigen::Vector3d place = scan.prior.position->position - map.origin;
  return map.tile_box(tile).exteriorDistance(place) <= scan.prior.position->radius + scan.reach;
}

/// The pair's prior is about the middle of the scan, whose place depends on the attitude.
RegistrationPrior prior_of_pair(const Scan& scan) {
  RegistrationPrior prior;
  prior.gravity = scan.prior.gravity;
  if (const auto& known = scan.prior.position) {
    PosePrior pose;
    pose.target_from_source.translation() = known->position - scan.middle;
    pose.max_rotation = 180;
    pose.max_translation = known->radius + 3 * scan.reach;
    prior.pose = pose;
  }
  return prior;
}

bool contradicts(const Scan& scan, const UnalignedIsometry3d& map_from_scan) {
  const auto& known = scan.prior.position;
  return known && (map_from_scan.translation() - known->position).norm() > known->radius;
}

/// Aligns every scan with the tiles begin..end - 1 and collects the modes.
void search_tiles(const Context& context, const MapState& map, std::size_t begin, std::size_t end,
                  const RegistrationOptions& options, std::vector<Scan>& scans) {
  std::vector<std::size_t> wanted;
  for (std::size_t tile = begin; tile < end; ++tile)
    if (std::any_of(scans.begin(), scans.end(),
                    [&](const Scan& scan) { return may_be_in(scan, map, tile); }))
      wanted.push_back(tile);
  std::vector<PreparedCloud> clouds = map.prepared_tiles(context, wanted);
  std::vector<Pair> pairs;
  std::vector<RegistrationPrior> priors;
  for (std::size_t k = 0; k < scans.size(); ++k) {
    clouds.push_back(scans[k].cloud);
    for (std::size_t t = 0; t < wanted.size(); ++t) {
      if (!may_be_in(scans[k], map, wanted[t])) continue;
      ++scans[k].tiles;
      pairs.push_back(
          {static_cast<std::uint32_t>(wanted.size() + k), static_cast<std::uint32_t>(t)});
      priors.push_back(prior_of_pair(scans[k]));
    }
  }
  const std::vector<RegistrationResult> results =
      align_batch(context, clouds, pairs, priors, options);
  for (std::size_t p = 0; p < pairs.size(); ++p) {
    Scan& scan = scans[pairs[p].source - wanted.size()];
    for (std::size_t m = 0; m < results[p].modes.size(); ++m) {
      const RegistrationMode& mode = results[p].modes[m];
      if (!contradicts(scan, mode.target_from_source))
        scan.candidates.push_back(
            {mode.target_from_source, mode.confidence, wanted[pairs[p].target], m});
    }
  }
}

void search(const Context& context, const MapState& map, const LocateOptions& options,
            std::vector<Scan>& scans) {
  RegistrationOptions registration = options.registration;
  registration.compatibility.max_matches = options.max_matches;
  // "Not in this map" needs the whole search: a contained scan has a low confidence at first.
  registration.compatibility.first_pass_reject = 0;
  for (std::size_t begin = 0; begin < map.tiles.size();) {
    std::size_t end = begin, points = 0;
    while (end < map.tiles.size() && (end == begin || points < kPointsAtOnce)) {
      points += map.tiles[end].end - map.tiles[end].begin;
      ++end;
    }
    search_tiles(context, map, begin, end, registration, scans);
    begin = end;
  }
  for (Scan& scan : scans) {
    scan.candidates = distinct(std::move(scan.candidates), scan.middle, registration.evidence,
                               options.candidates);
    while (scan.candidates.size() > 1 && scan.candidates.back().confidence < kHopeless)
      scan.candidates.pop_back();
  }
}

/// A candidate in all of the map around it.
struct Verified {
  PoseVerification verification;
  std::size_t points = 0;  ///< of the neighbourhood
};

std::vector<Verified> verify(const Context& context, const MapState& map,
                             const LocateOptions& options, const Scan& scan) {
  std::vector<PointCloud> around;
  std::vector<Pair> pairs;
  std::vector<std::vector<UnalignedIsometry3d>> poses;
  for (const Candidate& candidate : scan.candidates) {
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
  std::vector<Verified> out;
  for (std::size_t k = 0; k < results.size(); ++k)
    out.push_back({results[k].front(), clouds[k + 1].size()});
  std::stable_sort(out.begin(), out.end(), [](const Verified& a, const Verified& b) {
    return a.verification.confidence > b.verification.confidence;
  });
  return out;
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
    place.alias =
        !out.poses.empty() && v.verification.confidence >= options.registration.min_confidence;
    out.poses.push_back(place);
    alone.push_back(v.verification.confidence);
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
  std::vector<Scan> found;
  for (std::size_t k = 0; k < scans.size(); ++k)
    found.push_back(scan_of(prepared[k], priors.empty() ? LocatePrior{} : priors[k]));
  search(context, state, options, found);
  std::vector<LocateResult> out;
  for (const Scan& scan : found)
    out.push_back(result_of(verify(context, state, options, scan), scan, options));
  return out;
}

LocateResult locate(const Context& context, const PointCloudView& scan, const PreparedMap& map,
                    const LocatePrior& prior) {
  const float voxel_size = map.options().prepare.voxel_size;
  return locate(context, {scan}, map, LocateOptions::from_voxel_size(voxel_size), {prior}).front();
}

}  // namespace gpureg::localization
