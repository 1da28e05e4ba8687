// SPDX-License-Identifier: BSD-3-Clause
#include "portability/golden_maps.hpp"

#include "gpureg/calibration.hpp"
#include "gpureg/change.hpp"
#include "gpureg/reconstruction.hpp"

namespace gpureg::test {
namespace {

/// In the frame of the first scan, by the pairs with it.
std::vector<UnalignedIsometry3d> poses_of(const AlignedSet& set) {
  std::vector<UnalignedIsometry3d> poses(set.clouds.size(), no_pose());
  poses[0] = UnalignedIsometry3d::Identity();
  for (std::size_t p = 0; p < set.pairs.size(); ++p)
    if (set.pairs[p].target == 0 && set.results[p].aligned())
      poses[set.pairs[p].source] = set.results[p].target_from_source;
  return poses;
}

void add_audit(const std::string& name, const reconstruction::Audit& audit, Report& report) {
  for (const reconstruction::AuditedPair& pair : audit.pairs)
    report.line(name + " pair " + std::to_string(pair.source) + " " + std::to_string(pair.target) +
                " " + to_string(pair.verdict) + " " + hex(pair.log_likelihood_ratio) + " " +
                hex(pair.overlap) + " " + hex(pair.observed) + " " + hex(pair.violation) + " " +
                hex(pair.shift));
  for (const reconstruction::AuditedConnection& connection : audit.connections) {
    std::string scans;
    for (const std::uint32_t scan : audit.scans_of(connection)) scans += " " + std::to_string(scan);
    report.line(name + " connection" + scans + " " + to_string(connection.verdict) +
                " confidence " + hex(connection.confidence));
  }
}

/// Most pairs of generated rooms agree: samples of every confidence, a tenth of them false.
std::vector<CalibrationSample> samples_of(const AlignedSet& set) {
  std::vector<CalibrationSample> out;
  for (int k = 0; k < 40; ++k)
    for (const RegistrationResult& result : set.results) {
      CalibrationSample sample;
      sample.confidence = result.confidence * (1 - 0.01 * k);
      sample.correct = (out.size() * 7 + 3) % 10 != 0 || sample.confidence > 0.8;
      sample.kind = CalibrationKind::trajectory;
      out.push_back(sample);
    }
  return out;
}

}  // namespace

void add_audits(const Context& context, const AlignedSet& set, Report& report) {
  using namespace reconstruction;
  const AuditOptions options;
  std::vector<UnalignedIsometry3d> poses = poses_of(set);
  add_audit("audit", audit(context, set.clouds, poses, set.options, options), report);
  poses[2].translation().x() += 0.5;
  add_audit("audit of a wrong map", audit(context, set.clouds, poses, set.options, options),
            report);
  const AuditedReconstruction map =
      reconstruct(context, set.clouds, set.pairs, set.results,
                  reconstruction::Options{set.options.voxel_size}, {}, set.options, options);
  add_audit("audited map", map.audit, report);
  for (std::size_t k = 0; k < map.map.scans.size(); ++k)
    report.line(
        "audited map scan " + std::to_string(k) + " confidence " +
        hex(map.map.scans[k].confidence) +
        (map.map.scans[k].placed ? pose_text(map.map.scans[k].island_from_scan) : " left out"));
}

void add_places(const Context& context, const AlignedSet& set, Report& report) {
  using namespace localization;
  const float voxel_size = set.options.voxel_size;
  const std::vector<UnalignedIsometry3d> poses = poses_of(set);
  MapBuilder builder(MapOptions{voxel_size});
  std::vector<PointCloudView> left;
  for (std::size_t k = 0; k < set.scans.size(); ++k)
    if (k != 1 && poses[k].matrix().allFinite())
      builder.add_scan(context, set.scans[k].view(), poses[k]);
    else
      left.push_back(set.scans[k].view());
  const PreparedMap map = builder.build();
  const PointCloud cloud = map.cloud();
  report.line("place map " + std::to_string(map.size()) + " points " + hash_of(cloud.points) +
              " normals " + hash_of(cloud.normals));
  LocateOptions options = LocateOptions{RegistrationOptions{voxel_size}};
  options.min_confidence = 0.9999;  // all of the search
  const std::vector<LocateResult> results = locate(context, left, map, options);
  for (std::size_t k = 0; k < results.size(); ++k) {
    const std::string name = "place of " + std::to_string(k);
    report.line(name + " " + to_string(results[k].status) + " absent " +
                hex(results[k].absent_probability) + " tiles " + std::to_string(results[k].tiles));
    for (const LocatedPose& pose : results[k].poses)
      report.line(name + " confidence " + hex(pose.confidence) + pose_text(pose.map_from_scan) +
                  " evidence" + evidence_text(pose.verification.evidence));
  }
  // Of the other room, with the pose of this one: much is new, much is gone.
  for (const PointCloudView& scan : left) {
    const ChangeResult changes = find_changes(context, scan, map, poses[1]);
    report.line("changes" + pose_text(changes.map_from_scan) + " inliers " +
                hex(changes.inlier_ratio));
    for (const auto* points : {&changes.scan, &changes.map})
      report.line("changes new " + std::to_string(points->count(ChangeLabel::appeared)) + " gone " +
                  std::to_string(points->count(ChangeLabel::gone)) + " labels " +
                  hash_of(points->labels) + " probabilities " + hash_of(points->probabilities));
  }
}

void add_risk(const AlignedSet& set, Report& report) {
  const std::vector<CalibrationSample> samples = samples_of(set);
  const CalibrationFit fit = fit_calibration(samples);
  report.line("calibration slope " + hex(fit.calibration.slope) + " offset " +
              hex(fit.calibration.offset) + " errors " + hex(fit.error_before) + " " +
              hex(fit.error_after));
  const auto add = [&](const std::string& name, const RiskThreshold& found) {
    report.line(name + (found.supported ? " supported" : " not supported") + " from " +
                hex(found.min_confidence) + " reported " + std::to_string(found.reported) +
                " wrong " + std::to_string(found.wrong) + " recall " + hex(found.recall) +
                " more " + std::to_string(found.more_samples.value_or(0)));
  };
  for (const double max_risk : {0.05, 0.01, 0.001}) {
    RiskControl control;
    control.max_risk = max_risk;
    add("risk", control_risk(samples, control, fit.calibration));
    add("risk of scenes", control_risk_of_scenes(std::vector(20, samples), control));
  }
}

}  // namespace gpureg::test
