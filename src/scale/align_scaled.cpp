// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <cmath>
#include <map>
#include <optional>
#include <sstream>

#include "api/access.hpp"
#include "api/name_cloud.hpp"
#include "api/with_settings.hpp"
#include "common/stop_scope.hpp"
#include "common/validate.hpp"
#include "gpureg/registration/scale.hpp"
#include "gpureg/voxel_size.hpp"
#include "scale/ladder.hpp"
#include "scale/scale_search.hpp"

namespace gpureg {
namespace {

void check(const ScaleRange& range, const RegistrationSettings& options) {
  range.validate();
  if (range.is_known()) return;
  require(options.method == RegistrationMethod::compatibility, "method", to_string(options.method),
          "compatibility: only it can search the scale");
  require(options.prepare.voxel_size > 0, "prepare.downsample", "false",
          "true where the scale is searched");
}

/// The second search looks this far about the scale of the first, as a factor, and is made if its
/// voxels differ by more than a tenth.
constexpr double kNearScale = 1.05;
constexpr float kOtherVoxel = 0.1f;

ScaledResult of_known(RegistrationResult&& result, double scale) {
  ScaledResult out;
  out.scale = scale;
  out.scale_status = ScaleStatus::known;
  out.candidates.push_back({scale, result.symmetry_confidence()});
  out.result = std::move(result);
  return out;
}

}  // namespace

void ScaleRange::validate() const {
  if (is_free()) return;
  const auto check_end = [](double end, const char* name) {
    require(std::isfinite(end) && end > 0, name, end, "a finite number > 0");
  };
  check_end(least, "scale.least");
  check_end(most, "scale.most");
  if (least > most) {
    std::ostringstream text;
    text << "scale is " << least << " to " << most << ", expected the smaller end first";
    throw InvalidArgument(text.str());
  }
}

const char* to_string(ScaleStatus status) {
  switch (status) {
    case ScaleStatus::known:
      return "known";
    case ScaleStatus::found:
      return "found";
    case ScaleStatus::ambiguous:
      return "ambiguous";
    case ScaleStatus::not_observable:
      return "not_observable";
    case ScaleStatus::none:
      return "none";
  }
  return "unknown";
}

const char* explain(ScaleStatus status) {
  switch (status) {
    case ScaleStatus::known:
      return "the scale was given";
    case ScaleStatus::found:
      return "the scale was measured";
    case ScaleStatus::ambiguous:
      return "another scale fits about as well";
    case ScaleStatus::not_observable:
      return "the surfaces in common fit at other scales, too";
    case ScaleStatus::none:
      return "the clouds fit at no scale";
  }
  return "unknown";
}

std::string explain(const ScaledResult& result) {
  if (result.aligned()) return explain(result.scale_status);
  if (result.scale_status == ScaleStatus::not_observable) return explain(result.scale_status);
  if (result.scale_status == ScaleStatus::ambiguous && result.candidates.size() > 1) {
    std::ostringstream text;
    text << explain(result.scale_status) << ": " << result.candidates[0].scale << " has "
         << result.candidates[0].confidence << ", " << result.candidates[1].scale << " has "
         << result.candidates[1].confidence;
    return text.str();
  }
  return explain(result.result);
}

Eigen::Matrix4d ScaledResult::similarity() const {
  Eigen::Matrix4d out = result.target_from_source.matrix();
  out.topLeftCorner<3, 3>() *= scale;
  return out;
}

std::vector<ScaledResult> align_scaled_batch(
    const Context& context, const std::vector<PointCloudView>& clouds,
    const std::vector<Pair>& pairs, const ScaleRange& range, const RegistrationOptions& given,
    const ScaledCallbacks& callbacks, const std::vector<std::string>& names) {
  const RegistrationSettings options = resolve(given);
  check(range, options);
  check_names(names, clouds.size());
  for (std::size_t p = 0; p < pairs.size(); ++p)
    if (pairs[p].source >= clouds.size() || pairs[p].target >= clouds.size())
      throw InvalidArgument("pairs[" + std::to_string(p) + "] is (" +
                            std::to_string(pairs[p].source) + ", " +
                            std::to_string(pairs[p].target) + "), but there are " +
                            std::to_string(clouds.size()) + " clouds");
  const auto naming = [&](std::size_t k, auto&& action) {
    return naming_cloud(names, clouds.size(), k, action);
  };
  for (std::size_t k = 0; k < clouds.size(); ++k) naming(k, [&] { clouds[k].validate(); });

  std::vector<std::vector<std::size_t>> of_source(clouds.size());
  std::vector<std::uint32_t> order;
  for (std::size_t p = 0; p < pairs.size(); ++p) {
    if (of_source[pairs[p].source].empty()) order.push_back(pairs[p].source);
    of_source[pairs[p].source].push_back(p);
  }
  std::map<std::uint32_t, scale::PreparedTarget> targets;
  const auto target_of = [&](std::uint32_t k) -> const scale::PreparedTarget& {
    const auto known = targets.find(k);
    if (known != targets.end()) return known->second;
    naming(k, [&] { targets.emplace(k, scale::PreparedTarget(context, clouds[k], options)); });
    return targets.at(k);
  };

  std::vector<ScaledResult> results(pairs.size());
  bool stopped = false;
  for (const std::uint32_t source : order) {
    std::map<float, scale::PreparedLadder> ladders;  // by the voxel size of the search
    std::optional<PreparedCloud> known;
    for (const std::size_t p : of_source[source]) {
      StopScope::poll();
      stopped = stopped || (callbacks.should_stop && callbacks.should_stop());
      if (stopped) break;
      const scale::PreparedTarget& target = target_of(pairs[p].target);
      if (range.is_known()) {
        if (!known)
          known = naming(source, [&] {
            const scale::ScaledCloud scaled(clouds[source], range.least);
            return prepare(context, scaled.view(), options.prepare);
          });
        results[p] = of_known(align(context, *known, target.cloud, options), range.least);
      } else if (target.cloud.size() < 4) {
        results[p].result.status = RegistrationStatus::not_aligned;
        results[p].result.reason = RegistrationReason::too_few_target_points;
      } else {
        auto ladder = ladders.find(target.search.voxel_size);
        if (ladder == ladders.end())
          ladder = naming(source, [&] {
                     return ladders.emplace(
                         target.search.voxel_size,
                         scale::PreparedLadder(context, clouds[source], range, target.search));
                   }).first;
        results[p] = scale::search_scale(context, ladder->second, target, range, options);
      }
      if (callbacks.on_result) callbacks.on_result(p, results[p]);
    }
    if (stopped) break;
  }
  return results;
}

ScaledResult align_scaled(const Context& context, const PointCloudView& source,
                          const PointCloudView& target, const ScaleRange& range,
                          const RegistrationOptions& options) {
  return align_scaled_batch(context, {source, target}, {{0, 1}}, range, options, {},
                            {"source", "target"})
      .front();
}

ScaledResult align_scaled_auto(const Context& context, const PointCloudView& source,
                               const PointCloudView& target, const ScaleRange& range,
                               const RegistrationOptions& given) {
  range.validate();
  RegistrationOptions options = given;
  const auto suggested_at = [&](double scale) {
    const scale::ScaledCloud scaled(source, scale);
    return suggest_voxel_size({scaled.view(), target});
  };
  for (std::size_t k = 0; k < 2; ++k)
    naming_cloud({"source", "target"}, 2, k, [&] { (k == 0 ? source : target).validate(); });
  // Of a source in an unknown unit nothing follows for the target's.
  const VoxelSizeSuggestion suggestion =
      range.is_known() ? suggested_at(range.least) : suggest_voxel_size({target});
  if (suggestion.valid()) options.voxel_size = suggestion.voxel_size;
  ScaledResult first = align_scaled(context, source, target, range, options);
  if (first.scale_status != ScaleStatus::found) return first;
  const VoxelSizeSuggestion of_both = suggested_at(first.scale);
  if (!of_both.valid() || std::abs(of_both.voxel_size / options.voxel_size - 1) <= kOtherVoxel)
    return first;
  options.voxel_size = of_both.voxel_size;
  const ScaleRange near{
      std::max(range.least, first.scale / kNearScale),
      range.is_free() ? first.scale * kNearScale : std::min(range.most, first.scale * kNearScale)};
  if (near.least >= near.most) return first;  // refined to the end of the range, or beyond
  ScaledResult second = align_scaled(context, source, target, near, options);
  if (second.scale_status == ScaleStatus::none) return first;
  // The second is the better judge, but a viewpoint that only one of the two inferred may be wrong.
  const bool same_viewpoints = first.result.source_viewpoint == second.result.source_viewpoint &&
                               first.result.target_viewpoint == second.result.target_viewpoint;
  if (!same_viewpoints && second.result.symmetry_confidence() <= first.result.symmetry_confidence())
    return first;
  for (const ScaleCandidate& other : first.candidates)
    if (other.scale < near.least || other.scale > near.most) second.candidates.push_back(other);
  std::stable_sort(
      second.candidates.begin(), second.candidates.end(),
      [](const ScaleCandidate& a, const ScaleCandidate& b) { return a.confidence > b.confidence; });
  return second;
}

}  // namespace gpureg
