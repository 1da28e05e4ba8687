// SPDX-License-Identifier: BSD-3-Clause
#include "gpureg/time_budget.hpp"

#include <algorithm>
#include <chrono>
#include <cmath>

#include "api/frames.hpp"
#include "api/quality_levels.hpp"
#include "api/with_settings.hpp"
#include "common/validate.hpp"

namespace gpureg {
namespace {

constexpr double kConfident = 0.99;
/// Range of the measured growth over the predicted one: single measurements are noisy.
constexpr double kMinGrowth = 0.2, kMaxGrowth = 1.25;

bool same_pose(const RegistrationResult& a, const RegistrationResult& b,
               const EvidenceSettings& options) {
  return a.has_pose() && b.has_pose() &&
         same_mode_at(a.target_from_source, b.target_from_source,
                      middle_of(a.source_moments, Eigen::Vector3d::Zero()), options);
}

double ratio(double a, double b) { return b > 0 ? a / b : 1.0; }

}  // namespace

double predicted_milliseconds(const StageTimings& t, double overhead,
                              const RegistrationSettings& from, const RegistrationSettings& to) {
  // As many features are searched as matches are kept.
  const double matches = ratio(to.compatibility.max_matches, from.compatibility.max_matches);
  const double seeds = ratio(to.compatibility.seeds, from.compatibility.seeds);
  const double triangles = seeds * ratio(to.compatibility.triangles, from.compatibility.triangles);
  const double modes = ratio(to.evidence.modes, from.evidence.modes);
  return overhead + t.match * matches + t.propose * triangles + t.rank * seeds +
         (t.refine + t.verify) * modes;
}

TimedResult run_levels(const LevelRunner& runner, double milliseconds,
                       const RegistrationSettings& options) {
  const double begin = runner.now();
  TimedResult best;
  RegistrationResult last;
  double last_ms = 0, predicted = 0, previous_ms = 0;
  // Partly used devices take less time than in proportion; the growth from one level to the next
  // calibrates the prediction.
  double growth = 1.0;
  const auto prediction = [&](std::uint32_t quality) {
    const double overhead = std::max(0.0, last_ms - last.timings.total());
    const double whole =
        predicted_milliseconds(last.timings, overhead, options.with_quality(best.highest_quality),
                               options.with_quality(quality));
    return std::max(last_ms, last_ms + growth * (whole - last_ms));
  };
  for (std::uint32_t quality = 0;;) {
    const double started = runner.now();
    RegistrationResult result = runner.align(quality);
    const double ended = runner.now();
    const bool agree = best.levels > 0 && result.confidence >= kConfident &&
                       last.confidence >= kConfident && same_pose(result, last, options.evidence);
    if (best.levels == 0 || result.confidence >= best.result.confidence) {
      best.result = result;
      best.quality = quality;
    }
    previous_ms = last_ms;
    last_ms = ended - started;
    if (best.levels > 0 && predicted > previous_ms)
      growth = std::clamp(growth * (last_ms - previous_ms) / (predicted - previous_ms), kMinGrowth,
                          kMaxGrowth);
    ++best.levels;
    best.highest_quality = quality;
    best.milliseconds = ended - begin;
    last = std::move(result);
    if (agree || quality == kHighestQuality) return best;
    const double left = milliseconds - best.milliseconds;
    std::uint32_t next = quality + 1;
    if (prediction(next) > left) return best;
    // A confident result needs only a confirmation by the next level; otherwise the time goes into
    // the highest level that it allows.
    while (last.confidence < kConfident && next < kHighestQuality && prediction(next + 1) <= left)
      ++next;
    predicted = prediction(next);
    quality = next;
  }
}

TimedResult align_within(const Context& context, const PreparedCloud& source,
                         const PreparedCloud& target, double milliseconds,
                         const RegistrationOptions& given) {
  const RegistrationSettings options = resolve(given);
  const auto begin = std::chrono::steady_clock::now();
  require(std::isfinite(milliseconds) && milliseconds > 0, "milliseconds", milliseconds,
          "a time > 0");
  require(options.method == RegistrationMethod::compatibility, "method", to_string(options.method),
          "compatibility: only it has levels of quality");
  const auto now = [begin] {
    return std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - begin)
        .count();
  };
  return run_levels({[&](std::uint32_t quality) {
                       return align(context, source, target, options.with_quality(quality));
                     },
                     now},
                    milliseconds, options);
}

}  // namespace gpureg
