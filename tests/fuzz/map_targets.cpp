// SPDX-License-Identifier: BSD-3-Clause
#include <unistd.h>

#include <cmath>
#include <fstream>

#include "common/fnv1a.hpp"
#include "fields/audit.hpp"
#include "fields/localization.hpp"
#include "files/envelope.hpp"
#include "fuzz/inputs.hpp"
#include "fuzz/targets.hpp"
#include "gpureg/change.hpp"
#include "gpureg/reconstruction.hpp"
#include "io/run_reader.hpp"

namespace gpureg::fuzz {
namespace {

using namespace localization;

/// The sheets of cloud_of() are a metre wide.
constexpr float kVoxel = 0.05f;

const Context& one() {
  static const Context context = Context::cpu(1);
  return context;
}
const Context& two() {
  static const Context context = Context::cpu(2);
  return context;
}

bool is_probability(double value) { return value >= 0 && value <= 1; }

bool is_rigid(const UnalignedIsometry3d& pose) {
  const Eigen::Matrix3d r = pose.linear();
  return pose.matrix().allFinite() &&
         (r * r.transpose() - Eigen::Matrix3d::Identity()).norm() < 1e-2;
}

PreparedMap map_of(Bytes& bytes) {
  MapOptions options{kVoxel};
  vary(bytes, options);
  options.voxel_size = kVoxel;
  MapBuilder builder(options);
  for (std::uint32_t k = 1 + bytes.below(2); k > 0; --k) {
    const PointCloud cloud = cloud_of(bytes);
    if (bytes.flag())
      builder.add_cloud(cloud.view());
    else
      builder.add_scan(one(), cloud.view(), pose_of(bytes, 3));
  }
  return builder.build();
}

LocatePrior prior_of(Bytes& bytes) {
  const auto vector = [&](float most) {
    Eigen::Vector3d out;
    for (double& value : out) value = static_cast<double>(bytes.number(most));
    return out;
  };
  LocatePrior prior;
  if (bytes.flag()) {
    const Eigen::Vector3d up = vector(1), map_up = vector(1);
    prior.gravity = GravityPrior{up, map_up, static_cast<double>(bytes.number(200))};
  }
  if (bytes.flag()) {
    const Eigen::Vector3d place = vector(3) * std::pow(10.0, bytes.below(45));
    prior.position = PositionPrior{place, static_cast<double>(bytes.number(4))};
  }
  return prior;
}

void check_places(const LocateResult& result) {
  double sum = result.absent_probability;
  for (const LocatedPose& pose : result.poses) {
    if (!is_rigid(pose.map_from_scan)) broken("a place is a rigid motion");
    sum += pose.confidence;
  }
  if (!(std::abs(sum - 1) < 1e-6)) broken("places are exclusive");
}

void check_changes(const PointChanges& changes, std::size_t size) {
  if (changes.labels.size() != size || changes.probabilities.size() != size)
    broken("each point has a label");
  for (const float p : changes.probabilities)
    if (!is_probability(static_cast<double>(p))) broken("each label has a probability");
}

/// Places of a cloud in a map, the same on any threads.
void run_locate(std::string_view input) {
  Bytes bytes(input);
  try {
    const PreparedMap map = map_of(bytes);
    const PointCloud scan = cloud_of(bytes);
    LocateOptions options = LocateOptions{RegistrationOptions{kVoxel}};
    vary(bytes, options);
    options.registration.prepare = map.options().prepare;
    const std::vector<LocatePrior> priors{prior_of(bytes)};
    const LocateResult result = locate(one(), {scan.view()}, map, options, priors).front();
    check_places(result);
    const LocateResult again = locate(two(), {scan.view()}, map, options, priors).front();
    if (again.status != result.status || again.absent_probability != result.absent_probability ||
        again.poses.size() != result.poses.size())
      broken("threads change nothing");
  } catch (const InvalidArgument&) {
  }
}

/// What has changed between a map and a cloud, and its file.
void run_change(std::string_view input) {
  Bytes bytes(input);
  try {
    const PreparedMap map = map_of(bytes);
    const PointCloud scan = cloud_of(bytes);
    ChangeOptions options;
    vary(bytes, options);
    UnalignedIsometry3d pose = pose_of(bytes, 3);
    if (bytes.below(8) == 0)
      pose.matrix()(bytes.below(4), bytes.below(4)) = static_cast<double>(bytes.number(2));
    const ChangeResult result = find_changes(one(), scan.view(), map, pose, options);
    check_changes(result.scan, scan.points.size());
    check_changes(result.map, map.size());
    if (!is_rigid(result.map_from_scan)) broken("a pose is a rigid motion");
    const ChangeResult again = find_changes(two(), scan.view(), map, pose, options);
    if (again.scan.labels != result.scan.labels || again.map.labels != result.map.labels ||
        again.scan.probabilities != result.scan.probabilities)
      broken("threads change nothing");
    write_changes("/dev/null", map.cloud(), result.map);
  } catch (const InvalidArgument&) {
  }
}

/// The input is what follows the header: no mutation finds a checksum. What is read can be saved,
/// and scans can be compared with it and located in it.
void read_saved_map(std::string_view payload) {
  files::Envelope envelope;
  envelope.add(payload);
  const std::string content = envelope.header({"gpuregMP", 4, ""}) + std::string(payload);
  const test::MemoryFile file(content);
  if (!PreparedMap::is_saved(file.path())) broken("a saved map is known by its beginning");
  PreparedMap map;
  try {
    map = PreparedMap::load(file.path());
  } catch (const IoError& error) {
    if (std::string_view(error.what()).find(file.path()) == std::string_view::npos)
      broken("an error names its file");
    return;
  }
  static const std::string copy = "/dev/shm/gpureg-fuzz-" + std::to_string(::getpid());
  map.save(copy);
  const PreparedMap again = PreparedMap::load(copy);
  ::unlink(copy.c_str());
  const PointCloud cloud = map.cloud();
  if (again.size() != map.size() || again.tiles() != map.tiles() ||
      again.cloud().points != cloud.points)
    broken("a saved map reads back");
  // What uses it takes a hundred times as long: for some inputs, always the same.
  Fnv1a sum;
  sum.add_bytes(payload);
  if (sum.value() % 8 != 0) return;
  try {
    LocateOptions options = LocateOptions{RegistrationOptions{map.options().voxel_size, 0}};
    check_places(locate(one(), {cloud.view()}, map, options).front());
    const ChangeResult changes =
        find_changes(one(), cloud.view(), map, UnalignedIsometry3d::Identity());
    check_changes(changes.scan, map.size());
    check_changes(changes.map, map.size());
  } catch (const InvalidArgument&) {
  }
}

void check_audit(const reconstruction::Audit& audit) {
  for (const reconstruction::AuditedPair& pair : audit.pairs)
    if (!std::isfinite(pair.log_likelihood_ratio) || !is_probability(pair.overlap) ||
        !is_probability(pair.observed) || !is_probability(pair.violation))
      broken("an audited pair has evidence");
  for (const reconstruction::AuditedConnection& connection : audit.connections) {
    if (!is_probability(connection.confidence)) broken("a confidence is a probability");
    if (audit.scans_of(connection).empty()) broken("a connection has a part");
  }
}

/// Small maps of any poses, audited, and made of pairs of any poses.
void run_audit(std::string_view input) {
  using namespace reconstruction;
  Bytes bytes(input);
  RegistrationOptions registration{0.1f, 1};
  AuditOptions options;
  vary(bytes, options);
  std::vector<PreparedCloud> clouds;
  std::vector<UnalignedIsometry3d> poses;
  const std::uint32_t size = bytes.below(5);
  try {
    for (std::uint32_t k = 0; k < size; ++k) {
      clouds.push_back(prepare(one(), cloud_of(bytes).view(), registration));
      poses.push_back(bytes.below(8) == 0 ? no_pose() : pose_of(bytes, bytes.flag() ? 0.1f : 5.0f));
    }
    check_audit(audit(one(), clouds, poses, registration, options));
    std::vector<Pair> pairs;
    std::vector<RegistrationResult> results;
    for (std::uint32_t k = bytes.below(9); k > 0; --k) {
      pairs.push_back({bytes.below(size + 1), bytes.below(size + 1)});
      RegistrationResult result;
      if (bytes.below(8) != 0) {
        result.target_from_source = pose_of(bytes, 1);
        result.confidence = static_cast<double>(bytes.take<std::uint8_t>()) / 255;
        result.status = RegistrationStatus::aligned;
        RegistrationMode mode;
        mode.target_from_source = result.target_from_source;
        mode.confidence = result.confidence;
        result.modes.push_back(mode);
      }
      results.push_back(result);
    }
    const AuditedReconstruction map =
        reconstruct(one(), clouds, pairs, results, Options{0.1f}, {}, registration, options);
    check_audit(map.audit);
    for (const Scan& scan : map.map.scans)
      if (scan.placed && !is_rigid(scan.island_from_scan)) broken("a pose is a rigid motion");
  } catch (const InvalidArgument&) {
  }
}

}  // namespace

std::vector<Target> map_targets() {
  return {{"saved_map", read_saved_map},
          {"locate", run_locate},
          {"change", run_change},
          {"audit", run_audit}};
}

}  // namespace gpureg::fuzz
