// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <cmath>
#include <functional>
#include <iterator>
#include <string>

#include "calibration/risk_ladder.hpp"
#include "common/validate.hpp"
#include "gpureg/calibration.hpp"
#include "math/exponential.hpp"

namespace gpureg {
namespace calibration {

Counts count_from(const std::vector<CalibrationSample>& samples, double threshold) {
  Counts out;
  for (const CalibrationSample& sample : samples) {
    if (!(sample.confidence >= threshold)) continue;
    ++out.reported;
    ++(sample.correct ? out.correct : out.wrong);
  }
  return out;
}

void check_confidences(const std::vector<CalibrationSample>& samples, const std::string& name) {
  for (std::size_t k = 0; k < samples.size(); ++k)
    require(samples[k].confidence >= 0 && samples[k].confidence <= 1,
            (name + "[" + std::to_string(k) + "].confidence").c_str(), samples[k].confidence,
            "a probability in [0, 1]");
}

double log_level(const RiskControl& control) {
  return portable::log(control.max_failure / static_cast<double>(std::size(kStarts)));
}

void promise(std::size_t k, const std::vector<CalibrationSample>& samples,
             const ConfidenceCalibration& calibration, RiskThreshold& out) {
  const Counts counts = count_from(samples, kLadder[k]), all = count_from(samples, 0);
  out.supported = true;
  out.min_confidence = calibration(kLadder[k]);
  out.reported = counts.reported;
  out.wrong = counts.wrong;
  out.recall = static_cast<double>(counts.correct) / static_cast<double>(all.correct);
}

}  // namespace calibration

namespace {

using calibration::check_confidences;
using calibration::count_from;
using calibration::Counts;
using calibration::kLadder;
using calibration::kMostReports;
using calibration::kStarts;

/// Logarithm of the probability of at most `wrong` false ones of `count`, each false with
/// probability `risk`.
double log_tail(double wrong, double count, double risk) {
  const double log_odds = portable::log(risk) - portable::log1p(-risk);
  // The last term, then the sum of all in units of it; they fall towards the first.
  double log_last = count * portable::log1p(-risk), sum = 1, term = 1;
  for (double k = 1; k <= wrong; ++k) log_last += portable::log((count - k + 1) / k) + log_odds;
  const double inverse_odds = (1 - risk) / risk;
  for (double k = wrong; k >= 1; --k) {
    term *= k / (count - k + 1) * inverse_odds;
    sum += term;
  }
  return std::min(0.0, log_last + portable::log(sum));
}

bool passes(const Counts& counts, double risk, double log_level) {
  const auto wrong = static_cast<double>(counts.wrong),
             reported = static_cast<double>(counts.reported);
  // Above the mean the tail is no proof, and its terms do not fall.
  return wrong < risk * reported && log_tail(wrong, reported, risk) <= log_level;
}

/// Fewest reports that would pass with the same share of false ones; kMostReports: none would.
double reports_that_pass(const Counts& counts, double risk, double log_level) {
  const auto reported = static_cast<double>(std::max<std::size_t>(counts.reported, 1));
  const double share = static_cast<double>(counts.wrong) / reported;
  if (share >= risk) return kMostReports;
  const double factor = calibration::smallest_factor(
      [&](double f) {
        const double n = std::ceil(f * reported);
        return log_tail(std::ceil(share * n), n, risk) <= log_level;
      },
      1 / reported, kMostReports / reported);
  return std::ceil(factor * reported);
}

std::optional<std::size_t> more_samples(const std::vector<CalibrationSample>& samples, double risk,
                                        double log_level) {
  const auto all = static_cast<double>(samples.size());
  std::optional<std::size_t> fewest;
  for (const std::size_t start : kStarts) {
    const Counts counts = count_from(samples, kLadder[start]);
    // Without a sample nobody knows how many are reported: all, at best.
    if (counts.reported == 0 && !samples.empty()) continue;
    const double reports = reports_that_pass(counts, risk, log_level);
    if (reports >= kMostReports) continue;
    const double factor = counts.reported == 0 ? 1.0 : all / static_cast<double>(counts.reported);
    const double more = std::max(1.0, std::ceil(reports * factor - all));
    if (!fewest || more < static_cast<double>(*fewest)) fewest = static_cast<std::size_t>(more);
  }
  return fewest;
}

/// The largest confidence from which on more than `risk` of the reports are false; 0: none.
double last_failure(std::vector<CalibrationSample> samples, double risk) {
  std::sort(samples.begin(), samples.end(),
            [](const auto& a, const auto& b) { return a.confidence > b.confidence; });
  double wrong = 0;
  for (std::size_t k = 0; k < samples.size(); ++k) {
    wrong += samples[k].correct ? 0 : 1;
    // Equal confidences are reported together.
    if (k + 1 < samples.size() && samples[k + 1].confidence == samples[k].confidence) continue;
    if (wrong > risk * static_cast<double>(k + 1)) return samples[k].confidence;
  }
  return 0;
}

}  // namespace

void RiskControl::validate() const {
  require(max_risk > 0 && max_risk < 1, "max_risk", max_risk, "a share in (0, 1)");
  require(max_failure > 0 && max_failure < 1, "max_failure", max_failure,
          "a probability in (0, 1)");
}

std::vector<CalibrationSample> CalibrationResult::of_two_scans() const {
  std::vector<CalibrationSample> out;
  std::copy_if(samples.begin(), samples.end(), std::back_inserter(out),
               [](const CalibrationSample& s) { return s.kind != CalibrationKind::one_scan; });
  return out;
}

RiskThreshold control_risk(const std::vector<CalibrationSample>& samples,
                           const RiskControl& control, const ConfidenceCalibration& calibration) {
  control.validate();
  check_confidences(samples, "samples");
  const double level = calibration::log_level(control);
  RiskThreshold out;
  out.samples = samples.size();
  const std::size_t lowest = calibration::lowest_proved([&](double threshold) {
    return passes(count_from(samples, threshold), control.max_risk, level);
  });
  if (lowest == std::size(kLadder))
    out.more_samples = more_samples(samples, control.max_risk, level);
  else
    calibration::promise(lowest, samples, calibration, out);
  return out;
}

RiskThreshold control_risk_of_scenes(const std::vector<std::vector<CalibrationSample>>& scenes,
                                     const RiskControl& control,
                                     const ConfidenceCalibration& calibration) {
  control.validate();
  RiskThreshold out;
  out.scenes = scenes.size();
  std::vector<double> failures;
  for (std::size_t k = 0; k < scenes.size(); ++k) {
    const std::string name = "scenes[" + std::to_string(k) + "]";
    require(!scenes[k].empty(), (name + ".size").c_str(), 0, "one sample or more");
    check_confidences(scenes[k], name);
    out.samples += scenes[k].size();
    failures.push_back(last_failure(scenes[k], control.max_risk));
  }
  // So many scenes may fail, the further one included.
  const auto fails = static_cast<std::size_t>(
      std::floor(control.max_failure * static_cast<double>(scenes.size() + 1) * (1 + 1e-12)));
  if (fails == 0) {
    const double fewest = std::ceil(1 / control.max_failure * (1 - 1e-12)) - 1;
    out.more_scenes = static_cast<std::size_t>(fewest) - scenes.size();
    return out;
  }
  std::sort(failures.begin(), failures.end(), std::greater<>());
  // Below the ladder of control_risk() hardly any sample was seen. All calibrated confidences above
  // the failure are reported.
  const double threshold =
      std::max(calibration(kLadder[0]), std::nextafter(calibration(failures[fails - 1]), 2.0));
  if (threshold > 1) return out;
  out.supported = true;
  out.min_confidence = threshold;
  std::size_t correct = 0, all_correct = 0;
  for (const std::vector<CalibrationSample>& scene : scenes)
    for (const CalibrationSample& sample : scene) {
      const bool reported = calibration(sample.confidence) >= threshold;
      out.reported += reported ? 1 : 0;
      out.wrong += reported && !sample.correct ? 1 : 0;
      correct += reported && sample.correct ? 1 : 0;
      all_correct += sample.correct ? 1 : 0;
    }
  out.recall =
      all_correct == 0 ? 0 : static_cast<double>(correct) / static_cast<double>(all_correct);
  return out;
}

}  // namespace gpureg
