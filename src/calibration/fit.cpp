// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <cmath>
#include <string>

#include "common/validate.hpp"
#include "gpureg/calibration.hpp"
#include "math/exponential.hpp"

namespace gpureg {
namespace {

/// Standard deviations of the prior. Fits to the true verdicts of sensors and places that were
/// never trained on gave offsets from -1.8 to 2.2 and slopes from 0.4 to 2.
constexpr double kOffsetDeviation = 1.5, kSlopeDeviation = 0.5;
/// Log odds of a sample, at most so far from even: the odds of hopeless poses go down to 10^-30,
/// and one of them would decide the slope.
constexpr double kMostLogOdds = 7.0;
constexpr int kNewtonSteps = 100, kHalvings = 20;
constexpr double kConverged = 1e-9;
constexpr std::size_t kErrorBins = 10;

double log_odds_of(double confidence) {
  if (confidence <= 0) return -kMostLogOdds;
  if (confidence >= 1) return kMostLogOdds;
  return std::clamp(portable::log(confidence) - portable::log1p(-confidence), -kMostLogOdds,
                    kMostLogOdds);
}

void check(const std::vector<CalibrationSample>& samples) {
  for (std::size_t k = 0; k < samples.size(); ++k) {
    const std::string name = "samples[" + std::to_string(k) + "]";
    require(samples[k].confidence >= 0 && samples[k].confidence <= 1,
            (name + ".confidence").c_str(), samples[k].confidence, "a probability in [0, 1]");
    require(std::isfinite(samples[k].weight) && samples[k].weight >= 0, (name + ".weight").c_str(),
            samples[k].weight, "a finite number >= 0");
  }
}

/// log(1 + e^x), which neither overflows nor cancels.
double softplus(double x) {
  return x > 0 ? x + portable::log1p(portable::exp(-x)) : portable::log1p(portable::exp(x));
}

struct Point {
  double x, weight;
  bool correct;
};

/// Negative logarithm of the posterior, and its derivatives by offset and slope.
struct Posterior {
  double value = 0, gradient[2] = {0, 0}, curvature[3] = {0, 0, 0};
};

double value_at(const std::vector<Point>& points, double offset, double slope) {
  double sum = 0.5 * portable::square(offset / kOffsetDeviation) +
               0.5 * portable::square((slope - 1.0) / kSlopeDeviation);
  for (const Point& p : points) {
    const double z = offset + slope * p.x;
    sum += p.weight * softplus(p.correct ? -z : z);
  }
  return sum;
}

Posterior posterior_at(const std::vector<Point>& points, double offset, double slope) {
  Posterior out;
  out.value = value_at(points, offset, slope);
  out.gradient[0] = offset / portable::square(kOffsetDeviation);
  out.gradient[1] = (slope - 1.0) / portable::square(kSlopeDeviation);
  out.curvature[0] = 1.0 / portable::square(kOffsetDeviation);
  out.curvature[2] = 1.0 / portable::square(kSlopeDeviation);
  for (const Point& p : points) {
    const double probability = portable::logistic(offset + slope * p.x);
    const double error = p.weight * (probability - (p.correct ? 1.0 : 0.0));
    const double spread = p.weight * probability * (1.0 - probability);
    out.gradient[0] += error;
    out.gradient[1] += error * p.x;
    out.curvature[0] += spread;
    out.curvature[1] += spread * p.x;
    out.curvature[2] += spread * p.x * p.x;
  }
  return out;
}

/// Newton's method with halved steps; the posterior is strictly convex. fixed_slope: at a bound.
ConfidenceCalibration minimum(const std::vector<Point>& points, const double* fixed_slope) {
  double offset = 0, slope = fixed_slope ? *fixed_slope : 1.0;
  for (int k = 0; k < kNewtonSteps; ++k) {
    const Posterior p = posterior_at(points, offset, slope);
    double step[2];
    if (fixed_slope) {
      step[0] = p.gradient[0] / p.curvature[0];
      step[1] = 0;
    } else {
      const double determinant = p.curvature[0] * p.curvature[2] - p.curvature[1] * p.curvature[1];
      step[0] = (p.curvature[2] * p.gradient[0] - p.curvature[1] * p.gradient[1]) / determinant;
      step[1] = (p.curvature[0] * p.gradient[1] - p.curvature[1] * p.gradient[0]) / determinant;
    }
    double scale = 1;
    int halvings = 0;
    while (value_at(points, offset - scale * step[0], slope - scale * step[1]) >= p.value &&
           ++halvings < kHalvings)
      scale *= 0.5;
    if (halvings == kHalvings) break;
    offset -= scale * step[0];
    slope -= scale * step[1];
    if (std::abs(step[0]) + std::abs(step[1]) < kConverged) break;
  }
  return {slope, offset};
}

}  // namespace

const char* to_string(CalibrationKind kind) {
  switch (kind) {
    case CalibrationKind::one_scan:
      return "one_scan";
    case CalibrationKind::loop_consistency:
      return "loop_consistency";
    case CalibrationKind::trajectory:
      return "trajectory";
  }
  return "unknown";
}

CalibrationFit fit_calibration(const std::vector<CalibrationSample>& samples) {
  check(samples);
  std::vector<Point> points;
  std::size_t correct = 0, wrong = 0;
  for (const CalibrationSample& sample : samples) {
    if (sample.weight == 0) continue;
    points.push_back({log_odds_of(sample.confidence), sample.weight, sample.correct});
    ++(sample.correct ? correct : wrong);
  }
  CalibrationFit out;
  out.enough_samples = correct >= kMinCalibrationSamples && wrong >= kMinCalibrationSamples;
  if (out.enough_samples) {
    out.calibration = minimum(points, nullptr);
    const double bounded =
        std::clamp(out.calibration.slope, kMinCalibrationSlope, kMaxCalibrationSlope);
    if (bounded != out.calibration.slope) out.calibration = minimum(points, &bounded);
  }
  out.error_before = calibration_error(samples);
  out.error_after = calibration_error(samples, out.calibration);
  return out;
}

double calibration_error(const std::vector<CalibrationSample>& samples,
                         const ConfidenceCalibration& calibration) {
  check(samples);
  double weight[kErrorBins] = {}, confidence[kErrorBins] = {}, correct[kErrorBins] = {}, sum = 0;
  for (const CalibrationSample& sample : samples) {
    const double c = calibration(sample.confidence);
    const std::size_t bin = std::min(kErrorBins - 1, static_cast<std::size_t>(c * kErrorBins));
    weight[bin] += sample.weight;
    confidence[bin] += sample.weight * c;
    correct[bin] += sample.correct ? sample.weight : 0.0;
    sum += sample.weight;
  }
  double error = 0;
  for (std::size_t k = 0; k < kErrorBins; ++k) error += std::abs(confidence[k] - correct[k]);
  return sum > 0 ? error / sum : 0;
}

}  // namespace gpureg
