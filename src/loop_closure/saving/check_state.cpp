// SPDX-License-Identifier: BSD-3-Clause
#include "loop_closure/saving/check_state.hpp"

#include <cmath>
#include <set>
#include <string>

#include "gpureg/error.hpp"
#include "pose_graph/validate.hpp"

namespace gpureg::loop_closure {
namespace {

using pose_graph::require_confidence;
using pose_graph::require_information;

/// LoopRecord::key has room for so many modes of so many loops.
constexpr std::size_t kMostModes = 16;
constexpr std::uint64_t kMostArrivals = std::uint64_t{1} << 59;

std::string name_of(const char* what, FragmentId source, FragmentId target) {
  return what + std::string(" ") + std::to_string(source) + "-" + std::to_string(target);
}

void require(bool good, const std::string& name, const char* reason) {
  if (!good) throw InvalidArgument(name + " " + reason);
}

void require_pose(const UnalignedIsometry3d& pose, const std::string& name) {
  pose_graph::require_pose(pose, name);
  require(pose.matrix().row(3) == Eigen::RowVector4d(0, 0, 0, 1), name,
          "has a last row other than 0 0 0 1");
}

template <typename Enum>
bool is_one_of(Enum value, Enum last) {
  return static_cast<int>(value) >= 0 && static_cast<int>(value) <= static_cast<int>(last);
}

class Check {
 public:
  explicit Check(const State& state) : state_(state) {}

  void run() {
    require(std::isfinite(state_.voxel_size) && state_.voxel_size > 0, "the voxel size",
            "is no finite length > 0");
    require(state_.arrivals < kMostArrivals, "the number of arrivals", "is too large");
    for (const auto& [id, node] : state_.nodes) check(id, node);
    for (const Odometry& edge : state_.odometry) check(edge);
    for (const LoopRecord& record : state_.loops) check(record);
    for (const Proposal& proposal : state_.queue) check(proposal);
    for (const FragmentPair& pair : state_.known) check(pair);
  }

 private:
  /// Fragments, loops and proposals of the host are numbered together.
  void require_new(std::uint64_t number, const std::string& name) {
    require(number < state_.arrivals && numbers_.insert(number).second, name,
            "has the number of another one, or of a later one");
  }

  void require_ends(FragmentId source, FragmentId target, const std::string& name) const {
    require(state_.nodes.count(source) > 0 && state_.nodes.count(target) > 0, name,
            "names a fragment that is missing");
    require(source != target, name, "connects a fragment with itself");
  }

  void check(FragmentId id, const Node& node) {
    const std::string name = "fragment " + std::to_string(id);
    require_pose(node.estimate, name + ".estimate");
    if (node.given) require_pose(*node.given, name + ".given");
    require(std::isfinite(node.time), name, "has a time that is not finite");
    // As LoopCloser::add().
    require(!node.up || (node.up->norm() >= 1e-6 && node.up->norm() <= 1e9), name,
            "has an up of length 0, or of no finite length");
    require_new(node.order, name);
  }

  void check(const Odometry& edge) const {
    const std::string name = name_of("odometry", edge.source, edge.target);
    require_ends(edge.source, edge.target, name);
    require_pose(edge.target_from_source, name + ".target_from_source");
    require_information(edge.information, name + ".information");
    require(std::isfinite(edge.length) && edge.length >= 0, name, "has no finite length >= 0");
  }

  static void check(const Loop& loop, const std::string& name) {
    require(is_one_of(loop.state, LoopState::retracted), name, "has an unknown state");
    require(is_one_of(loop.reason, LoopReason::replaced), name, "has an unknown reason");
    if (!loop.target_from_source.matrix().array().isNaN().all())
      require_pose(loop.target_from_source, name + ".target_from_source");
    if (!loop.information.isZero(0)) require_information(loop.information, name + ".information");
    require_confidence(loop.confidence, name + ".confidence");
    require_confidence(loop.weight, name + ".weight");
    require(loop.drift_ratio >= 0, name, "has a drift ratio that is not >= 0");
  }

  void check(const LoopRecord& record) {
    const std::string name = name_of("loop", record.loop.source, record.loop.target);
    check(record.loop, name);
    if (record.reported) check(*record.reported, name);
    require_ends(record.source, record.target, name);
    require_new(record.number, name);
    require(record.modes.size() <= kMostModes, name, "has more than 16 modes");
    require(record.modes.empty() ? record.loop.state != LoopState::accepted
                                 : record.mode < record.modes.size(),
            name, "takes part with a mode that is missing");
    for (const Mode& mode : record.modes) {
      require_pose(mode.target_from_source, name + ".mode.target_from_source");
      require_information(mode.information, name + ".mode.information");
      require_confidence(mode.confidence, name + ".mode.confidence");
      require(mode.drift_ratio >= 0, name, "has a mode whose drift ratio is not >= 0");
    }
  }

  void check(const Proposal& proposal) {
    const std::string name = name_of("proposal", proposal.source, proposal.target);
    require_ends(proposal.source, proposal.target, name);
    require(is_one_of(proposal.kind, ProposalKind::between_frames), name, "has an unknown kind");
    require(std::isfinite(proposal.value), name, "has a value that is not finite");
    require(
        state_.nodes.at(proposal.source).has_cloud && state_.nodes.at(proposal.target).has_cloud,
        name, "names a fragment without a cloud");
    require(state_.known.count(pair_of(proposal.source, proposal.target)) > 0, name,
            "is not among the known pairs");
    if (proposal.prior) proposal.prior->validate(name + ".prior");
    if (proposal.kind == ProposalKind::host) require_new(proposal.order, name);
  }

  void check(const FragmentPair& pair) const {
    const std::string name = name_of("pair", pair.first, pair.second);
    require_ends(pair.first, pair.second, name);
    require(pair.first < pair.second, name, "has the larger fragment first");
  }

  const State& state_;
  std::set<std::uint64_t> numbers_;
};

}  // namespace

void check_state(const State& state) { Check(state).run(); }

}  // namespace gpureg::loop_closure
