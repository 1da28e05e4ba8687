// SPDX-License-Identifier: BSD-3-Clause
#include "scale/scale_search.hpp"

#include <algorithm>
#include <cmath>
#include <optional>

#include "api/access.hpp"
#include "api/with_settings.hpp"
#include "common/for_each_on.hpp"
#include "scale/limits.hpp"

namespace gpureg::scale {
namespace {

/// Confidence as a share of that of the first, below which a scale is not refined.
constexpr double kLeastChance = 0.05;
/// Odds of another scale, as a share of those of the first, that make the pair ambiguous.
constexpr double kRivalOdds = 0.5;

/// A scale with all its evidence.
struct Trial {
  double scale = 1;
  RegistrationResult result;
  RefinedScale refined;
  bool settled = false;

  /// The refined scale.
  double next(const ScaleRange& range) const {
    const bool lost = refined.points == 0 || std::abs(refined.factor - 1) > kMostChange;
    const double found = lost ? scale : scale * refined.factor;
    return range.is_free() ? found : std::clamp(found, range.least, range.most);
  }

  double confidence() const { return result.symmetry_confidence(); }
};

std::vector<Trial> tried(const Context& context, const PreparedLadder& source,
                         const PreparedTarget& target, const std::vector<double>& scales,
                         const RegistrationSettings& options) {
  std::vector<std::unique_ptr<ScaledCloud>> clouds;
  std::vector<PointCloudView> views;
  for (const double scale : scales) {
    clouds.push_back(std::make_unique<ScaledCloud>(source.source(), scale));
    views.push_back(clouds.back()->view());
  }
  std::vector<PreparedCloud> prepared = prepare_batch(context, views, options.prepare);
  std::vector<Pair> pairs;
  for (std::uint32_t k = 0; k < prepared.size(); ++k)
    pairs.push_back({k, static_cast<std::uint32_t>(prepared.size())});
  prepared.push_back(target.cloud);
  std::vector<RegistrationResult> results = align_batch(context, prepared, pairs, options);
  std::vector<Trial> out(scales.size());
  for_each_on(Access::engine(context)->host_threads(), out.size(), [&](std::size_t k) {
    Trial& trial = out[k];
    trial.scale = scales[k];
    trial.result = std::move(results[k]);
    if (!trial.result.has_pose()) return;
    const PreparedSurface surface(prepared[k],
                                  kReachOfSource * options.prepare.max_correspondence_distance);
    trial.refined = refine_scale(surface, target.surface, trial.result.target_from_source,
                                 options.refine.kernel_width);
  });
  return out;
}

/// Keeps the more confident one of trials that refinement leads to the same scale.
void keep_distinct(const ScaleRange& range, std::vector<Trial>& trials) {
  std::stable_sort(trials.begin(), trials.end(),
                   [](const Trial& a, const Trial& b) { return a.confidence() > b.confidence(); });
  std::vector<Trial> kept;
  for (Trial& trial : trials) {
    const auto same = [&](const Trial& other) {
      return std::abs(trial.next(range) / other.next(range) - 1) < kSameScale;
    };
    if (std::none_of(kept.begin(), kept.end(), same)) kept.push_back(std::move(trial));
  }
  trials = std::move(kept);
}

/// Tries refined scales until they settle.
void settle(const Context& context, const PreparedLadder& source, const PreparedTarget& target,
            const ScaleRange& range, const RegistrationSettings& options,
            std::vector<Trial>& trials) {
  for (int round = 0; round < kRounds; ++round) {
    keep_distinct(range, trials);
    std::vector<double> scales;
    std::vector<Trial*> of;
    for (Trial& trial : trials) {
      const double next = trial.next(range);
      // Those without a chance stay as they are.
      trial.settled = trial.settled || std::abs(next / trial.scale - 1) < kSettled ||
                      trial.confidence() < kLeastChance * trials.front().confidence();
      if (trial.settled) continue;
      scales.push_back(next);
      of.push_back(&trial);
    }
    if (scales.empty()) return;
    std::vector<Trial> again = tried(context, source, target, scales, options);
    for (std::size_t k = 0; k < again.size(); ++k) {
      // The pose may be another one, by chance.
      if (again[k].confidence() < 0.5 * of[k]->confidence())
        of[k]->settled = true;
      else
        *of[k] = std::move(again[k]);
    }
  }
  keep_distinct(range, trials);
}

/// Scales are exclusive: the first gets no more than its share of the odds.
void share_odds(const std::vector<Trial>& trials, ScaledResult& out) {
  double sum = 0, rival = 0;
  for (const Trial& trial : trials) {
    sum += odds_of(trial.confidence());
    if (&trial != &trials.front()) rival = std::max(rival, odds_of(trial.confidence()));
  }
  const double first = odds_of(trials.front().confidence()), before = trials.front().confidence();
  if (!(sum > first) || !(before > 0)) return;
  const double after = std::min(before, first / sum);
  if (rival > kRivalOdds * first) out.scale_status = ScaleStatus::ambiguous;
  for (RegistrationMode& mode : out.result.modes) {
    mode.confidence *= after / before;
    mode.overlap_confidence *= after / before;
  }
  out.result.confidence *= after / before;
}

void refuse(ScaledResult& out, RegistrationReason reason) {
  out.result.status = RegistrationStatus::not_aligned;
  out.result.reason = reason;
}

}  // namespace

PreparedLadder::PreparedLadder(const Context& context, const PointCloudView& source,
                               const ScaleRange& range, const PrepareSettings& options)
    : source_(source) {
  PrepareSettings prepare = options;
  prepare.surface_side_distance = 0;                   // matches need neither this ...
  if (prepare.depth_maps > 0) prepare.depth_maps = 1;  // ... nor free space
  std::vector<std::unique_ptr<ScaledCloud>> clouds;
  std::vector<PointCloudView> views;
  const std::vector<double> scales = ladder_of(source, range, prepare.voxel_size);
  for (const double scale : scales) {
    clouds.push_back(std::make_unique<ScaledCloud>(source, scale));
    views.push_back(clouds.back()->view());
  }
  std::vector<PreparedCloud> prepared;
  try {
    prepared = prepare_copies(context, views, scales, prepare);
  } catch (const InvalidArgument&) {
    // Scales at which no cloud can be prepared are none.
    for (const PointCloudView& view : views) try {
        prepared.push_back(prepare_copies(context, {view}, {1.0}, prepare).front());
      } catch (const InvalidArgument&) {
        prepared.push_back({});
      }
  }
  for (std::size_t k = 0; k < prepared.size(); ++k)
    if (prepared[k].valid())
      rungs_.push_back(
          {scales[k], prepared[k], Access::state(prepared[k])->copy_points_and_normals()});
}

PrepareSettings search_options(const PreparedCloud& target, const RegistrationSettings& options) {
  PrepareSettings out = options.prepare;
  constexpr float kLonger = 1.5f;
  for (std::size_t points = target.size(); points > kMostTargetPoints;
       points = static_cast<std::size_t>(static_cast<double>(points) / (kLonger * kLonger)))
    for (float* length :
         {&out.voxel_size, &out.normal_radius, &out.feature_radius, &out.wide_feature_radius,
          &out.max_correspondence_distance, &out.surface_side_distance})
      *length *= kLonger;
  return out;
}

PreparedTarget::PreparedTarget(const Context& context, const PointCloudView& target,
                               const RegistrationSettings& options)
    : cloud(prepare(context, target, options.prepare)),
      search(search_options(cloud, options)),
      coarse(search.voxel_size == options.prepare.voxel_size ? cloud
                                                             : prepare(context, target, search)),
      points(Access::state(coarse)->copy_points_and_normals()),
      surface(cloud, kReach * options.prepare.max_correspondence_distance) {}

ScaledResult search_scale(const Context& context, const PreparedLadder& source,
                          const PreparedTarget& target, const ScaleRange& range,
                          const RegistrationSettings& options) {
  ScaledResult out;
  const std::vector<double> scales = propose_scales(context, source, target, range, options);
  if (scales.empty()) {
    out.result.status = RegistrationStatus::not_aligned;
    out.result.reason = source.rungs().empty() ? RegistrationReason::too_few_source_points
                                               : RegistrationReason::no_candidate;
    return out;
  }
  std::vector<Trial> trials = tried(context, source, target, scales, options);
  settle(context, source, target, range, options, trials);
  const Trial& best = trials.front();
  out.scale = best.scale;
  out.result = best.result;
  out.scale_status = out.result.has_pose() ? ScaleStatus::found : ScaleStatus::none;
  for (const Trial& trial : trials) out.candidates.push_back({trial.scale, trial.confidence()});
  out.information = best.refined.information;
  if (const double left = best.refined.points > 0 ? best.refined.scale_information : 0; left > 0)
    out.scale_deviation = best.refined.rms / std::sqrt(left);
  share_odds(trials, out);
  if (out.scale_status == ScaleStatus::none) return out;
  if (best.refined.stiffness < kLeastStiffness) {
    out.scale_status = ScaleStatus::not_observable;
    refuse(out, RegistrationReason::underconstrained);
  } else if (out.aligned() && out.result.symmetry_confidence() < options.min_confidence) {
    refuse(out, RegistrationReason::ambiguous);
  }
  return out;
}

}  // namespace gpureg::scale
