// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <map>
#include <set>
#include <string>

#include "loop_closure/state.hpp"

/// Checks of what the host passes: a pose graph takes what passes. All throw InvalidArgument naming
/// field and value.
namespace gpureg::loop_closure {

/// The ids and odometry edges that calls may name, up to date before process() sees them.
class Registry {
 public:
  Registry() = default;
  explicit Registry(const State& state);

  void add(FragmentId id, bool has_cloud);
  void remove(FragmentId id);
  void connect(FragmentId source, FragmentId target);
  void require_known(FragmentId id) const;
  void require_pair(FragmentId source, FragmentId target) const;
  void require_clouds(FragmentId source, FragmentId target) const;
  std::size_t size() const { return has_cloud_.size(); }

 private:
  std::map<FragmentId, bool> has_cloud_;
  std::set<FragmentPair> odometry_;
};

void check_fragment(const Fragment& fragment, const Options& options);
/// A state that was read belongs to a closer of these options.
void check_voxel_size(const State& state, const Options& options, const std::string& path);
void check_pose(const UnalignedIsometry3d& pose, const std::string& name);
void check_result(const RegistrationResult& result);
/// What a result, or Options::noise, has made of the information of its modes.
void check_modes(const LoopRecord& record);

/// An edge of add_odometry().
Odometry odometry_edge(FragmentId source, FragmentId target,
                       const UnalignedIsometry3d& target_from_source,
                       const std::optional<UnalignedMatrix6d>& covariance, const Options& options);

/// A loop of add_loop().
LoopRecord host_record(FragmentId source, FragmentId target, const UnalignedIsometry3d& pose,
                       const std::optional<UnalignedMatrix6d>& information, double confidence,
                       const Options& options);

/// Asks for the clouds of a loaded state.
void give_clouds(State& state, const CloudProvider& clouds, const Options& options);

}  // namespace gpureg::loop_closure
