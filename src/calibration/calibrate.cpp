// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <cmath>
#include <cstring>
#include <string>

#include "calibration/halves.hpp"
#include "calibration/labels.hpp"
#include "common/fnv1a.hpp"
#include "common/rigid.hpp"
#include "common/validate.hpp"
#include "gpureg/calibration.hpp"
#include "gpureg/voxel_size.hpp"

namespace gpureg {
namespace {

using calibration::confidence_of;
using calibration::Halves;
using calibration::is_correct;

/// Pairs of one scan that are prepared and aligned together.
constexpr std::size_t kPairsPerChunk = 16;
/// Clouds of a group whose pairs are all tried: five loops of correct pairs decide a pair.
constexpr std::size_t kGroup = 12;
/// Weight of a sample made of one scan: its halves saw the same surfaces from the same place. A fit
/// to such samples alone made the error of true pairs hardly smaller for any of four kinds of data,
/// and larger for two. They keep the fit from running away where loops decide only correct pairs,
/// or only false ones.
constexpr double kOneScanWeight = 0.05;
constexpr std::uint32_t kMostPairs = 1'000'000;

void check_poses(const std::vector<UnalignedIsometry3d>& poses, std::size_t clouds) {
  if (poses.empty()) return;
  if (poses.size() != clouds)
    throw InvalidArgument("world_from_cloud has " + std::to_string(poses.size()) +
                          " poses, but there are " + std::to_string(clouds) + " clouds");
  for (std::size_t k = 0; k < poses.size(); ++k) {
    if (poses[k].matrix().array().isNaN().all()) continue;
    require_rigid(poses[k], "world_from_cloud[" + std::to_string(k) + "]");
  }
}

/// One call of calibrate().
class Calibration {
 public:
  Calibration(const Context& context, const std::vector<PointCloudView>& clouds,
              const RegistrationOptions& options, const CalibrationOptions& calibration,
              const std::vector<UnalignedIsometry3d>& poses, const CalibrationCallbacks& callbacks)
      : context_(context),
        clouds_(clouds),
        options_(options),
        o_(calibration),
        poses_(poses),
        callbacks_(callbacks) {
    options_.calibration = {};
  }

  CalibrationResult run() {
    prepared_ = prepare_batch(context_, clouds_, options_);
    for (std::uint32_t k = 0; k < clouds_.size(); ++k)
      if (prepared_[k].size() > 0) usable_.push_back(k);
    choose_pairs();
    const std::size_t of_one_scan = usable_.empty() ? 0 : o_.self_pairs;
    total_ = of_one_scan + pairs_.size();
    if (!align_halves(of_one_scan) || !align_pairs()) {
      CalibrationResult stopped;
      stopped.stopped = true;
      return stopped;
    }
    if (poses_.empty())
      judge_by_loops();
    else
      judge_by_trajectory();
    const CalibrationFit fit = fit_calibration(out_.samples);
    out_.enough_samples =
        fit.enough_samples &&
        out_.loop_consistency.samples + out_.trajectory.samples >= kMinDecidedPairs;
    out_.error_before = out_.error_after = fit.error_before;
    if (out_.enough_samples) {
      out_.calibration = fit.calibration;
      out_.error_after = fit.error_after;
    }
    return std::move(out_);
  }

 private:
  bool stop() const { return callbacks_.should_stop && callbacks_.should_stop(); }
  void advance(std::size_t pairs) {
    done_ += pairs;
    if (callbacks_.on_progress) callbacks_.on_progress(done_, total_);
  }

  void add(CalibrationKind kind, const Pair& scans, const RegistrationResult& result, bool correct,
           double weight) {
    CalibrationCount& count = kind == CalibrationKind::one_scan           ? out_.one_scan
                              : kind == CalibrationKind::loop_consistency ? out_.loop_consistency
                                                                          : out_.trajectory;
    ++count.samples;
    count.correct += correct;
    out_.samples.push_back(
        {confidence_of(result), correct, weight, kind, scans.source, scans.target});
  }

  /// All pairs, or all within groups of consecutive clouds, evenly spread.
  void choose_pairs() {
    const std::size_t n = usable_.size();
    out_.scan_groups.assign(clouds_.size(), kNoScanGroup);
    std::uint32_t groups_added = 0;
    const auto add_pairs = [&](std::size_t begin, std::size_t end) {
      for (std::size_t i = begin; i < end; ++i) {
        out_.scan_groups[usable_[i]] = groups_added;
        for (std::size_t j = i + 1; j < end; ++j) pairs_.push_back({usable_[j], usable_[i]});
      }
      ++groups_added;
    };
    if (n * (n - std::min<std::size_t>(n, 1)) / 2 <= o_.scan_pairs) return add_pairs(0, n);
    std::size_t group = kGroup;
    while (group > 2 && group * (group - 1) / 2 > o_.scan_pairs) --group;
    const std::size_t in_group = group * (group - 1) / 2;
    const std::size_t groups = std::min(o_.scan_pairs / in_group, n / group);
    for (std::size_t g = 0; g < groups; ++g) {
      const std::size_t begin = groups > 1 ? g * (n - group) / (groups - 1) : (n - group) / 2;
      add_pairs(begin, begin + group);
    }
  }

  /// false: stopped.
  bool align_halves(std::size_t count) {
    const double voxel = static_cast<double>(options_.voxel_size);
    std::vector<double> noise(usable_.size(), -1.0);
    for (std::size_t begin = 0; begin < count; begin += kPairsPerChunk) {
      if (stop()) return false;
      const std::size_t end = std::min(count, begin + kPairsPerChunk);
      std::vector<Halves> halves;
      std::vector<PointCloudView> views;
      std::vector<Pair> pairs;
      for (std::size_t k = begin; k < end; ++k) {
        const std::size_t at = k % usable_.size();
        const std::uint32_t cloud = usable_[at];
        if (noise[at] < 0) noise[at] = suggest_voxel_size({clouds_[cloud]}).noise;
        halves.push_back(calibration::halves_of(clouds_[cloud], prepared_[cloud], noise[at],
                                                4 * voxel, options_.seed,
                                                static_cast<std::uint32_t>(k)));
      }
      for (const Halves& pair : halves) {
        const auto first = static_cast<std::uint32_t>(views.size());
        pairs.push_back({first, first + 1});
        views.push_back(pair.source.view());
        views.push_back(pair.target.view());
      }
      const std::vector<PreparedCloud> prepared = prepare_batch(context_, views, options_);
      const std::vector<RegistrationResult> results =
          align_batch(context_, prepared, pairs, options_);
      for (std::size_t k = 0; k < results.size(); ++k) {
        ++out_.one_scan.pairs;
        if (!results[k].has_pose()) continue;
        const std::uint32_t cloud = usable_[(begin + k) % usable_.size()];
        add(CalibrationKind::one_scan, {cloud, cloud}, results[k],
            is_correct(results[k], halves[k].target_from_source, prepared[pairs[k].source].points(),
                       o_.max_error * voxel),
            kOneScanWeight);
      }
      advance(end - begin);
    }
    return true;
  }

  /// false: stopped.
  bool align_pairs() {
    BatchCallbacks callbacks;
    callbacks.on_result = [&](std::size_t, const RegistrationResult&) { advance(1); };
    bool stopped = false;
    callbacks.should_stop = [&] { return stopped = stopped || stop(); };
    results_ = align_batch(context_, prepared_, pairs_, options_, callbacks);
    return !stopped;
  }

  void judge_by_trajectory() {
    const double max_rms = o_.max_error * static_cast<double>(options_.voxel_size);
    for (std::size_t k = 0; k < poses_.size(); ++k)
      if (!poses_[k].matrix().allFinite()) out_.scan_groups[k] = kNoScanGroup;
    for (std::size_t p = 0; p < pairs_.size(); ++p) {
      const UnalignedIsometry3d &source = poses_[pairs_[p].source],
                                &target = poses_[pairs_[p].target];
      if (!source.matrix().allFinite() || !target.matrix().allFinite()) continue;
      ++out_.trajectory.pairs;
      if (!results_[p].has_pose()) continue;
      const PreparedCloud& cloud = prepared_[pairs_[p].source];
      std::vector<Eigen::Vector3f> points = cloud.points();
      for (Eigen::Vector3f& point : points)
        point = (point.cast<double>() + cloud.origin()).cast<float>();
      add(CalibrationKind::trajectory, pairs_[p], results_[p],
          is_correct(results_[p], Eigen::Isometry3d((target.inverse() * source).matrix()), points,
                     max_rms),
          1.0);
    }
  }

  void judge_by_loops() {
    out_.loop_consistency.pairs = pairs_.size();
    const auto verdicts = calibration::verdicts_of_loops(pairs_, results_, options_.voxel_size);
    for (std::size_t p = 0; p < pairs_.size(); ++p)
      if (verdicts[p])
        add(CalibrationKind::loop_consistency, pairs_[p], results_[p], *verdicts[p], 1.0);
  }

  const Context& context_;
  const std::vector<PointCloudView>& clouds_;
  RegistrationOptions options_;
  const CalibrationOptions& o_;
  const std::vector<UnalignedIsometry3d>& poses_;
  const CalibrationCallbacks& callbacks_;
  std::vector<PreparedCloud> prepared_;
  std::vector<std::uint32_t> usable_;  ///< clouds with points
  std::vector<Pair> pairs_;
  std::vector<RegistrationResult> results_;
  CalibrationResult out_;
  std::size_t done_ = 0, total_ = 0;
};

}  // namespace

std::uint64_t cloud_fingerprint(const PointCloudView& cloud) {
  Fnv1a hash;
  for (std::size_t k = 0; k < cloud.size; ++k) {
    std::uint32_t words[3];
    std::memcpy(words, cloud.points + k * cloud.point_stride, sizeof words);
    for (const std::uint32_t word : words) hash.add(word);
  }
  return hash.value();
}

void CalibrationOptions::validate() const {
  require(self_pairs <= kMostPairs, "self_pairs", self_pairs, "at most 1,000,000");
  require(scan_pairs <= kMostPairs, "scan_pairs", scan_pairs, "at most 1,000,000");
  require(std::isfinite(max_error) && max_error > 0, "max_error", max_error, "voxels > 0");
}

CalibrationResult calibrate(const Context& context, const std::vector<PointCloudView>& clouds,
                            const RegistrationOptions& options,
                            const CalibrationOptions& calibration,
                            const std::vector<UnalignedIsometry3d>& world_from_cloud,
                            const CalibrationCallbacks& callbacks) {
  options.validate();
  calibration.validate();
  require(options.method == RegistrationMethod::compatibility, "method", to_string(options.method),
          "compatibility: only it has a confidence");
  check_poses(world_from_cloud, clouds.size());
  return Calibration(context, clouds, options, calibration, world_from_cloud, callbacks).run();
}

}  // namespace gpureg
