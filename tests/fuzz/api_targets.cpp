// SPDX-License-Identifier: BSD-3-Clause
#include <unistd.h>

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <optional>
#include <string>

#include "fuzz/inputs.hpp"
#include "fuzz/targets.hpp"
#include "gpureg/loop_closure.hpp"
#include "gpureg/loop_consistency.hpp"
#include "gpureg/pose_graph/optimize.hpp"
#include "gpureg/registration.hpp"
#include "gpureg/surface_set.hpp"
#include "gpureg/verification.hpp"
#include "gpureg/voxel_size.hpp"
#include "support/result_bytes.hpp"

namespace gpureg::fuzz {
namespace {

void check_result(const RegistrationResult& r) {
  if (!(r.confidence >= 0 && r.confidence <= 1))
    broken("the confidence is a probability or a ratio");
  for (const RegistrationMode& mode : r.modes) {
    if (!(mode.confidence >= 0 && mode.confidence <= 1)) broken("a confidence is a probability");
    if (!(mode.overlap_confidence <= mode.confidence)) broken("overlap only lowers the confidence");
  }
  if (!r.has_pose()) {
    if (r.aligned()) broken("an aligned pair has a pose");
    return;
  }
  const Eigen::Matrix3d rotation = r.target_from_source.linear();
  if (!r.target_from_source.matrix().allFinite() ||
      (rotation * rotation.transpose() - Eigen::Matrix3d::Identity()).norm() > 1e-9 ||
      !(rotation.determinant() > 0))
    broken("a pose is a rigid motion");
}

/// Refusals are InvalidArgument; whatever is accepted gives the same bytes on any threads.
void run_align(std::string_view input) {
  Bytes bytes(input);
  const RegistrationOptions options = options_of(bytes);
  const PointCloud a = cloud_of(bytes), b = cloud_of(bytes);
  static const Context one = Context::cpu(1), two = Context::cpu(2);
  try {
    const RegistrationResult first = align(one, a.view(), b.view(), options);
    check_result(first);
    if (test::bytes(align(two, a.view(), b.view(), options)) != test::bytes(first))
      broken("threads change nothing");
  } catch (const InvalidArgument&) {
  }
}

void run_verify(std::string_view input) {
  Bytes bytes(input);
  const RegistrationOptions options = options_of(bytes);
  const PointCloud a = cloud_of(bytes), b = cloud_of(bytes);
  static const Context context = Context::cpu(1);
  std::vector<UnalignedIsometry3d> poses(bytes.below(4), UnalignedIsometry3d::Identity());
  for (UnalignedIsometry3d& pose : poses) pose = pose_of(bytes, 3);
  VerificationOptions verification;
  verification.refine = bytes.flag();
  verification.search_alternatives = bytes.flag();
  RegistrationPrior prior;
  if (bytes.flag()) {
    prior.gravity = GravityPrior{};
    prior.gravity->max_angle = static_cast<double>(bytes.number(200));
  }
  if (bytes.flag() && !poses.empty())
    prior.pose = PosePrior{poses[0], static_cast<double>(bytes.number(200)),
                           static_cast<double>(bytes.number(4))};
  try {
    const PreparedCloud source = prepare(context, a.view(), options),
                        target = prepare(context, b.view(), options);
    for (const PoseVerification& v :
         verify_poses(context, source, target, poses, options, verification))
      if (!(v.confidence >= 0 && v.confidence <= 1)) broken("a confidence is a probability");
    check_result(align(context, source, target, options, prior));
    suggest_voxel_size({a.view(), b.view()});
  } catch (const InvalidArgument&) {
  }
}

/// Scans with a normal and a variance for each point.
struct FuzzedSurface {
  explicit FuzzedSurface(Bytes& bytes) : cloud(cloud_of(bytes)) {
    const bool varied = bytes.flag();
    for (std::size_t k = 0; k < cloud.points.size(); ++k) {
      if (k >= cloud.normals.size()) cloud.normals.emplace_back(0, 0, 1);
      if (cloud.normals[k].norm() > 0 && !bytes.flag()) cloud.normals[k].normalize();
      if (varied) variances.push_back(1 + bytes.number(3));
    }
  }
  SurfaceView view() const {
    SurfaceView out;
    out.size = cloud.points.size();
    out.points = out.size > 0 ? cloud.points.data()->data() : nullptr;
    out.normals = out.size > 0 ? cloud.normals.data()->data() : nullptr;
    out.variances = variances.empty() ? nullptr : variances.data();
    return out;
  }
  PointCloud cloud;
  std::vector<float> variances;
};

/// Sums are the same on any threads, finite, and those of a pair alone.
void run_surface_set(std::string_view input) {
  Bytes bytes(input);
  static const Context one = Context::cpu(1), two = Context::cpu(2);
  const std::vector<FuzzedSurface> surfaces{FuzzedSurface(bytes), FuzzedSurface(bytes)};
  const std::vector<SurfaceView> views{surfaces[0].view(), surfaces[1].view()};
  PointToPlaneOptions options;
  options.max_distance = static_cast<double>(std::abs(bytes.number(2)));
  options.kernel_width = static_cast<double>(std::abs(bytes.number(1)));
  options.max_normal_angle = static_cast<double>(bytes.number(100));
  options.max_points = bytes.below(200);
  std::vector<SurfacePair> pairs(bytes.below(4));
  for (SurfacePair& pair : pairs) {
    pair.source = bytes.below(3);
    pair.target = bytes.below(3);
    for (int k = 0; k < 3; ++k)
      pair.target_from_source.translation()[k] = static_cast<double>(bytes.number(2));
  }
  try {
    const auto sums = SurfaceSet(one, views).linearise(pairs, options);
    const SurfaceSet other(two, views);
    for (std::size_t k = 0; k < pairs.size(); ++k) {
      const PointToPlaneSums alone = other.linearise({pairs[k]}, options).front();
      if (!sums[k].information.allFinite() || !sums[k].gradient.allFinite())
        broken("sums are finite");
      if (alone.information != sums[k].information || alone.gradient != sums[k].gradient ||
          alone.count != sums[k].count || alone.squared_distance != sums[k].squared_distance)
        broken("threads and other pairs change nothing");
    }
  } catch (const InvalidArgument&) {
  }
}

/// Small graphs of any shape, robustly optimised.
void run_pose_graph(std::string_view input) {
  Bytes bytes(input);
  pose_graph::Graph graph;
  const auto pose = [&] { return pose_of(bytes, 5); };
  const std::uint32_t nodes = bytes.below(9);
  for (std::uint32_t k = 0; k < nodes; ++k) {
    pose_graph::Node node;
    node.id = bytes.below(4) == 0 ? bytes.take<std::int16_t>() : k;
    if (bytes.flag()) node.world_from_node = pose();
    node.fixed = bytes.below(8) == 0;
    graph.nodes.push_back(node);
  }
  for (std::uint32_t k = bytes.below(16); k > 0; --k) {
    pose_graph::Edge edge;
    edge.source = bytes.below(9);
    edge.target = bytes.below(9);
    edge.target_from_source = pose();
    edge.kind = bytes.flag() ? pose_graph::EdgeKind::loop : pose_graph::EdgeKind::odometry;
    edge.confidence = static_cast<double>(bytes.take<std::uint8_t>()) / 255;
    if (bytes.flag()) {
      edge.information = pose_graph::UnalignedMatrix6d::Identity();
      for (int i = 0; i < 6; ++i)
        (*edge.information)(i, i) = static_cast<double>(bytes.number(1000));
    }
    for (std::uint32_t m = bytes.below(3); m > 0; --m)
      edge.alternatives.push_back({pose(), std::nullopt, 0.1});
    graph.edges.push_back(edge);
  }
  if (bytes.flag())
    graph.gravity.push_back({static_cast<std::int64_t>(bytes.below(9)), {0, 0, 1}, 1});
  pose_graph::Options options;
  options.threads = 1;
  options.robust = bytes.flag() ? pose_graph::Robust::gnc : pose_graph::Robust::line_process;
  try {
    const pose_graph::Result result = pose_graph::optimize(graph, options);
    for (const UnalignedIsometry3d& p : result.world_from_node)
      if (!p.matrix().allFinite()) broken("poses are finite");
  } catch (const InvalidArgument&) {
  }
}

/// Calls of a host in any order, with numbers of any size. What is refused throws at once;
/// process() takes the rest, and so does a saved state.
class Host {
 public:
  explicit Host(std::string_view input) : bytes_(input), closer_(context(), options()) {}

  void run() {
    for (int k = 0; k < 60 && !bytes_.empty(); ++k) {
      try {
        call(bytes_.below(9));
      } catch (const InvalidArgument&) {
      }
      if (bytes_.below(8) == 0) closer_.process();
    }
    closer_.process();
    for (const loop_closure::FragmentPose& pose : closer_.poses())
      if (!pose.world_from_fragment.matrix().allFinite()) broken("poses are finite");
    static const std::string path = "/dev/shm/gpureg-fuzz-" + std::to_string(::getpid());
    closer_.save(path);
    closer_.load(path, nullptr);
    ::unlink(path.c_str());
  }

 private:
  static const Context& context() {
    static const Context one = Context::cpu(1);
    return one;
  }

  loop_closure::Options options() {
    loop_closure::Options out =
        bytes_.flag() ? loop_closure::Options{} : loop_closure::Options::loopsmart();
    out.graph.threads = 1;
    out.optimize = bytes_.flag();
    if (bytes_.flag()) out.gravity_sigma = 1;
    return out;
  }

  /// Mostly of the size of a room.
  double number() {
    const double size = bytes_.below(8) == 0 ? std::pow(10.0, int(bytes_.below(40)) - 20) : 5.0;
    return static_cast<double>(bytes_.number(1)) * size;
  }

  UnalignedIsometry3d pose() {
    UnalignedIsometry3d out = UnalignedIsometry3d::Identity();
    out.linear() =
        Eigen::Quaterniond(1, number(), number(), number()).normalized().toRotationMatrix();
    for (int k = 0; k < 3; ++k) out.translation()[k] = number();
    return out;
  }

  std::optional<pose_graph::UnalignedMatrix6d> matrix() {
    if (bytes_.flag()) return std::nullopt;
    Eigen::Matrix<double, 6, 6> root = Eigen::Matrix<double, 6, 6>::Zero();
    for (int row = 0; row < 6; ++row)
      for (int column = 0; column <= row; ++column)
        if (row == column || bytes_.below(8) == 0) root(row, column) = number();
    return pose_graph::UnalignedMatrix6d(root * root.transpose());
  }

  double confidence() { return static_cast<double>(bytes_.take<std::uint8_t>()) / 255; }

  RegistrationResult result() {
    RegistrationResult out;
    for (std::uint32_t m = bytes_.below(4); m > 0; --m) {
      RegistrationMode mode;
      mode.confidence = confidence();
      mode.target_from_source = pose();
      if (bytes_.flag())
        for (double& eigenvalue : mode.evidence.information_eigenvalues) eigenvalue = number();
      out.modes.push_back(mode);
    }
    if (out.modes.empty()) return out;
    out.target_from_source = out.modes[0].target_from_source;
    out.confidence = out.modes[0].confidence;
    return out;
  }

  void call(std::uint32_t which) {
    const loop_closure::FragmentId a = bytes_.below(12), b = bytes_.below(12);
    switch (which) {
      case 0:
      case 1:
        return closer_.add(
            {a,
             bytes_.below(2),
             number(),
             {},
             pose(),
             bytes_.flag() ? std::optional(Eigen::Vector3d(number(), number(), 1)) : std::nullopt});
      case 2:
      case 3:
        return closer_.add_odometry(a, b, pose(), matrix());
      case 4:
        return closer_.add_loop(a, b, pose(), matrix(), confidence());
      case 5:
        return closer_.add_result(a, b, result());
      case 6:
        return closer_.set_poses({{a, pose()}});
      case 7:
        return closer_.remove(a);
      default:
        return closer_.set_covisible(a, {b});
    }
  }

  Bytes bytes_;
  loop_closure::LoopCloser closer_;
};

void run_loop_closer(std::string_view input) { Host(input).run(); }

/// Pairs with modes of any pose and confidence.
void run_consistency(std::string_view input) {
  Bytes bytes(input);
  std::vector<Pair> pairs;
  std::vector<RegistrationResult> results;
  for (std::uint32_t k = bytes.below(13); k > 0; --k) {
    pairs.push_back({bytes.below(6), bytes.below(6)});
    RegistrationResult result;
    result.status = bytes.flag() ? RegistrationStatus::aligned : RegistrationStatus::not_aligned;
    for (std::uint32_t m = bytes.below(4); m > 0; --m) {
      RegistrationMode mode;
      mode.confidence = static_cast<double>(bytes.take<std::uint8_t>()) / 255;
      mode.target_from_source.translation() << static_cast<double>(bytes.number(3)),
          static_cast<double>(bytes.number(3)), static_cast<double>(bytes.number(3));
      result.modes.push_back(mode);
    }
    if (!result.modes.empty()) {
      result.target_from_source = result.modes[0].target_from_source;
      result.confidence = result.modes[0].confidence;
    }
    results.push_back(result);
  }
  try {
    for (const PairConsistency& c : loop_consistency(pairs, results))
      if (!(c.confidence >= 0 && c.confidence <= 1)) broken("a confidence is a probability");
  } catch (const InvalidArgument&) {
  }
}

}  // namespace

std::vector<Target> api_targets() {
  return {{"align", run_align},
          {"verify", run_verify},
          {"surface_set", run_surface_set},
          {"pose_graph", run_pose_graph},
          {"consistency", run_consistency},
          {"loop_closer_calls", run_loop_closer}};
}

}  // namespace gpureg::fuzz
