// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <numeric>

#include "common/shown.hpp"
#include "fields/localization.hpp"
#include "localization/check_scan.hpp"
#include "localization/plan/plan_search.hpp"
#include "localization/verify_places.hpp"

namespace gpureg::localization {
namespace {

/// Least confidence of the verification with which a place of the plan takes part in the search of
/// the tiles.
constexpr double kPossible = 0.05;

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

/// A caller who asks for more confidence than usual gets the whole search before "not found".
bool is_sure(const LocateResult& result, const LocateSettings& options) {
  return !result.poses.empty() &&
         result.poses.front().confidence >= std::max(kSure, options.min_confidence);
}

/// Leaves the places of the plan that the verification finds possible.
void keep_possible(const std::vector<Verified>& places, Scan& scan) {
  scan.planned.clear();
  for (const Verified& v : places) {
    if (v.confidence < kPossible) continue;
    scan.planned.push_back(v.candidate);
    scan.planned.back().confidence = v.confidence;
  }
}

LocateResult result_of(const std::vector<Verified>& verified, const Scan& scan,
                       const LocateSettings& options) {
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
    place.alias = !out.poses.empty() && v.confidence >= options.min_confidence;
    out.poses.push_back(place);
    alone.push_back(v.confidence);
  }
  const std::vector<double> shared = shared_probability(alone);
  for (std::size_t k = 0; k < out.poses.size(); ++k) out.poses[k].confidence = shared[k];
  out.absent_probability = shared.back();
  out.status = status_of(out, options.min_confidence);
  return out;
}

/// Sets the results of the scans that the plan of the map places surely, first with little effort.
/// @return numbers of the others.
std::vector<std::size_t> see_from_above(const Context& context, const MapState& map,
                                        const LocateSettings& options, std::vector<Scan>& scans,
                                        std::vector<LocateResult>& results) {
  std::vector<std::size_t> open(scans.size());
  std::iota(open.begin(), open.end(), std::size_t{0});
  for (const PlanEffort& effort : {kUsualEffort, kThoroughEffort}) {
    std::vector<Scan*> asked;
    for (const std::size_t k : open) asked.push_back(&scans[k]);
    search_plan(context, map, options.candidates, effort, asked);
    for (Scan* scan : asked) {
      scan->candidates = scan->planned;
      keep_likely(options, *scan);
    }
    const std::vector<std::vector<Verified>> places =
        verify_planned(context, map, options, effort.first_kernel, asked);
    std::vector<std::size_t> unsure;
    for (std::size_t k = 0; k < open.size(); ++k) {
      LocateResult& result = results[open[k]];
      result = result_of(places[k], *asked[k], options);
      if (is_sure(result, options)) continue;
      keep_possible(places[k], *asked[k]);
      unsure.push_back(open[k]);
    }
    open = unsure;
  }
  return open;
}

void check(const MapState& map, const LocateSettings& options, std::size_t scans,
           const std::vector<LocatePrior>& priors, const std::vector<std::string>& names) {
  const auto fits = [&](std::size_t count, const char* what) {
    if (count != 0 && count != scans)
      throw InvalidArgument(std::string(what) + " has " + std::to_string(count) +
                            " entries, but scans has " + std::to_string(scans));
  };
  fits(priors.size(), "priors");
  fits(names.size(), "names");
  for (std::size_t k = 0; k < priors.size(); ++k)
    priors[k].validate("priors[" + std::to_string(k) + "]");
  const float of_map = map.given.voxel_size, of_options = options.options.voxel_size;
  if (of_map != of_options)
    throw InvalidArgument("registration.voxel_size is " + shown(of_options) +
                          ", but the map was made with " + shown(of_map));
}

}  // namespace

std::vector<LocateResult> locate(const Context& context, const std::vector<PointCloudView>& scans,
                                 const PreparedMap& map, const LocateOptions& given,
                                 const std::vector<LocatePrior>& priors,
                                 const std::vector<std::string>& names) {
  const MapState& state = MapState::of(map);
  const LocateSettings options = resolve(given);
  check(state, options, scans.size(), priors, names);
  for (std::size_t k = 0; k < scans.size(); ++k) {
    scans[k].validate();
    const std::string name = names.empty() ? "scans[" + std::to_string(k) + "]" : names[k];
    check_unit(scans[k], state, name);
    refuse_flat(scans[k], name);
  }
  const std::vector<PreparedCloud> prepared =
      prepare_batch(context, scans, state.options.prepare, names);
  std::vector<Scan> all;
  for (std::size_t k = 0; k < scans.size(); ++k)
    all.push_back(scan_of(prepared[k], priors.empty() ? LocatePrior{} : priors[k]));
  std::vector<LocateResult> out(scans.size());
  const std::vector<std::size_t> open = see_from_above(context, state, options, all, out);
  std::vector<Scan> searched;
  for (const std::size_t k : open) searched.push_back(std::move(all[k]));
  if (open.empty()) return out;
  const bool coarse_first = options.coarse_factor > 1;
  const double coarsest = coarsest_factor(state, options);
  const auto thinned = [&](double factor) {
    std::vector<PointCloudView> views;
    std::vector<std::string> of_views;
    for (const std::size_t k : open) {
      views.push_back(scans[k]);
      if (!names.empty()) of_views.push_back(names[k]);
    }
    return prepare_batch(context, views, prepare_for(state, factor), of_views);
  };
  const auto set = [&](PreparedCloud Scan::* cloud, std::vector<PreparedCloud> clouds) {
    for (std::size_t k = 0; k < open.size(); ++k) searched[k].*cloud = std::move(clouds[k]);
  };
  if (coarse_first)
    set(&Scan::coarse, thinned(options.coarse_factor));
  else
    for (Scan& scan : searched) scan.coarse = scan.cloud;
  if (coarsest > 0) set(&Scan::coarsest, thinned(coarsest));
  search_all_tiles(context, state, options, searched);
  std::vector<std::vector<Verified>> verified;
  std::vector<std::size_t> unsure;
  for (std::size_t k = 0; k < open.size(); ++k) {
    Scan& scan = searched[k];
    const double best = best_searched(scan);
    const bool hopeless =
        coarse_first && best < kHopelessSearch && scan.coarse.size() >= kTellingPoints;
    if (hopeless && !scan.candidates.empty()) scan.candidates.resize(1);
    verified.push_back(verify_places(context, state, options, scan));
    LocateResult& result = out[open[k]];
    result = result_of(verified[k], scan, options);
    result.stage = coarse_first ? SearchStage::coarse_tiles : SearchStage::tiles;
    if (coarse_first && !hopeless && !is_sure(result, options) && best < kSureSearch)
      unsure.push_back(k);
  }
  if (unsure.empty()) return out;
  search_best_tiles(context, state, options, unsure, searched);
  for (const std::size_t k : unsure) {
    out[open[k]] = result_of(verify_places(context, state, options, searched[k], verified[k]),
                             searched[k], options);
    out[open[k]].stage = SearchStage::tiles;
  }
  return out;
}

LocateResult locate(const Context& context, const PointCloudView& scan, const PreparedMap& map,
                    const LocatePrior& prior) {
  const LocateOptions options{RegistrationOptions{map.options().voxel_size}};
  return locate(context, {scan}, map, options, {prior}).front();
}

}  // namespace gpureg::localization
