// SPDX-License-Identifier: BSD-3-Clause
#include "localization/verify_places.hpp"

#include <algorithm>

#include "api/verify_by_surfaces.hpp"
#include "common/for_each_on.hpp"
#include "common/without_features.hpp"
#include "fields/localization.hpp"
#include "localization/plan/floor_plan.hpp"

namespace gpureg::localization {
namespace {

/// Sets the confidences of the places of a scan.
void judge(const Scan& scan, const EvidenceSettings& options, bool planned,
           std::vector<Verified>& places) {
  std::vector<PlaceEvidence> evidence;
  for (const Verified& v : places) evidence.push_back(v.evidence);
  const std::vector<double> confidences =
      place_confidences(evidence, planned, [&](std::size_t a, std::size_t b) {
        return same_place(places[a].verification.target_from_source,
                          places[b].verification.target_from_source, scan.middle, options);
      });
  for (std::size_t k = 0; k < places.size(); ++k) places[k].confidence = confidences[k];
  std::stable_sort(places.begin(), places.end(), [](const Verified& a, const Verified& b) {
    return a.confidence > b.confidence;
  });
}

/// Sparse scans overlap little in narrow voxels: what is not sure there and possible in the wide
/// ones of the search is verified in these, too. @return confidences of 0 where it is not.
std::vector<PoseVerification> verify_coarsely(const Context& context, const MapState& map,
                                              const LocateSettings& options, const Scan& scan,
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
  VerificationOptions verification;
  verification.refine = true;
  const auto results = verify_poses_batch(
      context, clouds, pairs, poses, options.registration_at(options.coarse_factor), verification);
  for (std::size_t k = 0; k < asked.size(); ++k) out[asked[k]] = results[k].front();
  return out;
}

/// Neighbourhoods that are cut out, and points that are prepared and compared, together.
constexpr std::size_t kPlacesAtOnce = 64, kPointsTogether = 400'000;

/// Sweeps of few rings see walls alone, so that a refinement stops at a wrong height: poses so many
/// voxels above and below that of a candidate are refined, too.
constexpr double kUp = 3;

std::vector<UnalignedIsometry3d> with_other_heights(const UnalignedIsometry3d& pose,
                                                    const Eigen::Vector3d& step) {
  std::vector<UnalignedIsometry3d> out(3, pose);
  out[1].translation() += step;
  out[2].translation() -= step;
  return out;
}

/// A candidate of a scan and the map around it.
struct Place {
  std::size_t scan;
  const Candidate* candidate;
  PointCloud around;
};

void compare_surfaces(const Context& context, const MapState& map, const LocateSettings& options,
                      float first_kernel, const std::vector<Scan*>& scans, const Place* begin,
                      const Place* end, std::vector<std::vector<Verified>>& out) {
  std::size_t most = 0;
  std::vector<PointCloudView> views;
  for (const Place* place = begin; place != end; ++place)
    most = std::max(most, place->around.points.size());
  const WithoutFeatures without(most);
  for (const Place* place = begin; place != end; ++place)
    views.push_back(without.of(view_of(place->around)));
  PrepareSettings prepare = as_they_are(map.options.prepare);
  prepare.wide_feature_radius = 0;
  std::vector<PreparedCloud> clouds = prepare_batch(context, views, prepare);
  std::vector<Pair> pairs;
  std::vector<std::vector<UnalignedIsometry3d>> poses;
  const Eigen::Vector3d step = kUp * static_cast<double>(map.options.prepare.voxel_size) *
                               map.plan(host_threads(context)).turn.row(2).cast<double>();
  for (const Place* place = begin; place != end; ++place) {
    if (place == begin || place->scan != place[-1].scan)
      clouds.push_back(scans[place->scan]->cloud);
    pairs.push_back(
        {static_cast<std::uint32_t>(clouds.size() - 1), static_cast<std::uint32_t>(place - begin)});
    poses.push_back(with_other_heights(place->candidate->map_from_scan, step));
  }
  const auto verify = [&](const RegistrationSettings& registration) {
    return verify_by_surfaces(context, clouds, pairs, poses, registration, true,
                              confidence_of_surfaces);
  };
  if (first_kernel > 0) {
    RegistrationSettings wide = options.registration;
    wide.refine.kernel_width *= first_kernel;
    const auto refined = verify(wide);
    for (std::size_t k = 0; k < refined.size(); ++k)
      for (std::size_t h = 0; h < poses[k].size(); ++h)
        poses[k][h] = refined[k][h].target_from_source;
  }
  const auto results = verify(options.registration);
  for (std::size_t k = 0; k < results.size(); ++k) {
    const Candidate& candidate = *begin[k].candidate;
    const PoseVerification& pose =
        *std::max_element(results[k].begin(), results[k].end(),
                          [](const auto& a, const auto& b) { return a.confidence < b.confidence; });
    out[begin[k].scan].push_back(
        {candidate, pose, clouds[k].size(),
         planned_evidence(candidate.confidence, pose, scans[begin[k].scan]->points.size()), 0});
  }
}

}  // namespace

std::vector<Verified> verify_places(const Context& context, const MapState& map,
                                    const LocateSettings& options, const Scan& scan,
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
    out.push_back(known == before.end() ? Verified{candidate, {}, 0, {}, 0} : *known);
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
    v.evidence =
        tile_evidence(v.candidate.confidence, v.verification, coarse[k], scan.points.size());
  }
  judge(scan, options.registration.evidence, false, out);
  return out;
}

std::vector<std::vector<Verified>> verify_planned(const Context& context, const MapState& map,
                                                  const LocateSettings& options, float first_kernel,
                                                  const std::vector<Scan*>& scans) {
  std::vector<Place> places;
  for (std::size_t k = 0; k < scans.size(); ++k)
    for (const Candidate& candidate : scans[k]->candidates) places.push_back({k, &candidate, {}});
  std::vector<std::vector<Verified>> out(scans.size());
  for (std::size_t begin = 0; begin < places.size();) {
    const std::size_t some = std::min(kPlacesAtOnce, places.size() - begin);
    for_each_on(host_threads(context), some, [&](std::size_t k) {
      Place& place = places[begin + k];
      place.around = neighborhood(map, scans[place.scan]->points, place.candidate->map_from_scan,
                                  options.neighborhood);
    });
    const std::size_t last = begin + some;
    while (begin < last) {
      std::size_t end = begin, points = 0;
      do points += places[end++].around.points.size();
      while (end < last && points + places[end].around.points.size() <= kPointsTogether);
      compare_surfaces(context, map, options, first_kernel, scans, &places[begin], &places[0] + end,
                       out);
      for (; begin < end; ++begin) places[begin].around = {};
    }
  }
  for (std::size_t k = 0; k < out.size(); ++k)
    judge(*scans[k], options.registration.evidence, true, out[k]);
  return out;
}

}  // namespace gpureg::localization
