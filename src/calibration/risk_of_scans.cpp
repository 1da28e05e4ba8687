// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <cmath>
#include <map>
#include <string>
#include <unordered_set>
#include <utility>

#include "calibration/risk_ladder.hpp"
#include "common/validate.hpp"
#include "gpureg/calibration.hpp"
#include "math/exponential.hpp"

namespace gpureg {
namespace {

using calibration::kLadder;
using calibration::kMostReports;
using calibration::kStarts;

/// Shares of false reports that bets are placed on, as parts of the risk, and the part of the
/// stake on each: a folder without a false report needs as few scans as possible.
constexpr double kBets[] = {0, 0.25, 0.5, 0.75}, kStakes[] = {0.5, 0.25, 0.125, 0.125};
/// exp() of it is far beyond every level and finite.
constexpr double kMostLog = 600;

/// A bet that less than `risk` of the reports are false in the long run: if that is not so, it pays
/// at most 1 on average. The mean of a likelihood ratio for each share of kBets.
class Bet {
 public:
  explicit Bet(double risk) {
    for (std::size_t k = 0; k < std::size(kBets); ++k) {
      const double share = kBets[k] * risk;
      correct_[k] = portable::log1p(-share) - portable::log1p(-risk);
      wrong_[k] = k == 0 ? 0 : portable::log(kBets[k]);
    }
  }
  double pays(double correct, double wrong) const {
    double sum =
        wrong > 0 ? 0 : kStakes[0] * portable::exp(std::min(kMostLog, correct * correct_[0]));
    for (std::size_t k = 1; k < std::size(kBets); ++k)
      sum +=
          kStakes[k] * portable::exp(std::min(kMostLog, correct * correct_[k] + wrong * wrong_[k]));
    return sum;
  }

 private:
  double correct_[std::size(kBets)], wrong_[std::size(kBets)];
};

/// The samples by rounds of a tournament: in a round, every scan meets at most one other of its
/// group, and in all rounds of a group every other one once.
class Rounds {
 public:
  Rounds(const std::vector<CalibrationSample>& samples, const std::vector<std::uint32_t>& groups)
      : samples_(samples) {
    std::map<std::uint32_t, std::uint32_t> sizes;
    std::vector<std::uint32_t> places(groups.size());
    for (std::size_t k = 0; k < groups.size(); ++k)
      if (groups[k] != kNoScanGroup) places[k] = sizes[groups[k]]++;
    for (const auto& [group, size] : sizes) {
      scans_ += size;
      rounds_ = std::max(rounds_, rounds_of(size));
    }
    for (const CalibrationSample& sample : samples) {
      const std::uint32_t size = sizes[groups[sample.source]], rounds = rounds_of(size);
      const auto [a, b] = std::minmax(places[sample.source], places[sample.target]);
      // The last one of an even number stays where it is, the others go around.
      steps_.push_back(rounds);
      first_.push_back((b == rounds ? 2 * a : a + b) % rounds);
    }
  }

  std::size_t scans() const { return scans_; }

  /// The mean of what all rounds pay. They are drawn alike and the pairs of each are independent,
  /// so it is at most 1 on average.
  double mean_pay(const Bet& bet, double threshold) const {
    std::vector<std::size_t> correct(rounds_), wrong(rounds_);
    for (std::size_t k = 0; k < samples_.size(); ++k)
      if (samples_[k].confidence >= threshold)
        for (std::size_t round = first_[k]; round < rounds_; round += steps_[k])
          ++(samples_[k].correct ? correct : wrong)[round];
    double sum = 0;
    for (std::size_t round = 0; round < rounds_; ++round)
      sum += bet.pays(static_cast<double>(correct[round]), static_cast<double>(wrong[round]));
    return sum / static_cast<double>(rounds_);
  }

  /// Mean number of pairs of a round that are reported correctly and falsely. Without a sample
  /// nobody knows how many are reported: all, at best.
  std::pair<double, double> mean_counts(double threshold) const {
    if (samples_.empty()) return {1, 0};
    double correct = 0, wrong = 0;
    for (std::size_t k = 0; k < samples_.size(); ++k)
      if (samples_[k].confidence >= threshold)
        (samples_[k].correct ? correct : wrong) += 1.0 / steps_[k];
    return {correct, wrong};
  }

 private:
  static std::uint32_t rounds_of(std::uint32_t size) {
    return std::max(1u, size % 2 == 0 ? size - 1 : size);
  }

  const std::vector<CalibrationSample>& samples_;
  std::size_t scans_ = 0;
  std::uint32_t rounds_ = 1;
  std::vector<std::size_t> first_,
      steps_;  ///< of each sample: its first round, and after how many again
};

std::optional<std::size_t> more_scans(const Rounds& rounds, const Bet& bet, double pay) {
  const auto scans = static_cast<double>(rounds.scans()), unit = std::max(2.0, scans);
  double fewest = kMostReports;
  for (const std::size_t start : kStarts) {
    const auto [correct, wrong] = rounds.mean_counts(kLadder[start]);
    const double factor = calibration::smallest_factor(
        [&, c = correct, w = wrong](double f) { return bet.pays(f * c, f * w) >= pay; }, 0.5 / unit,
        kMostReports / unit);
    fewest = std::min(fewest, std::ceil(factor * unit));
  }
  if (fewest >= kMostReports) return std::nullopt;
  return static_cast<std::size_t>(std::max(1.0, fewest - scans));
}

void check_scans(const std::vector<CalibrationSample>& samples,
                 const std::vector<std::uint32_t>& groups) {
  std::unordered_set<std::uint64_t> seen;
  for (std::size_t k = 0; k < samples.size(); ++k) {
    const auto [a, b] = std::minmax(samples[k].source, samples[k].target);
    const std::string name = "samples[" + std::to_string(k) + "].";
    require(b < groups.size(), (name + (b == samples[k].source ? "source" : "target")).c_str(), b,
            "the number of a scan");
    require(a != b, (name + "target").c_str(), b, "another scan than the source");
    require(groups[a] == groups[b] && groups[a] != kNoScanGroup, (name + "target").c_str(),
            samples[k].target, "a scan of the group of the source");
    require(seen.insert(static_cast<std::uint64_t>(a) << 32 | b).second, (name + "target").c_str(),
            samples[k].target, "a pair that is given once");
  }
}

}  // namespace

RiskThreshold control_risk_of_scans(const std::vector<CalibrationSample>& samples,
                                    const std::vector<std::uint32_t>& scan_groups,
                                    const RiskControl& control,
                                    const ConfidenceCalibration& calibration) {
  control.validate();
  calibration::check_confidences(samples, "samples");
  check_scans(samples, scan_groups);
  const Rounds rounds(samples, scan_groups);
  const Bet bet(control.max_risk);
  const double pay = portable::exp(-calibration::log_level(control));
  RiskThreshold out;
  out.samples = samples.size();
  out.scans = rounds.scans();
  const std::size_t lowest = calibration::lowest_proved(
      [&](double threshold) { return rounds.mean_pay(bet, threshold) >= pay; });
  if (lowest == std::size(kLadder))
    out.more_scans = more_scans(rounds, bet, pay);
  else
    calibration::promise(lowest, samples, calibration, out);
  return out;
}

}  // namespace gpureg
