// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <gtest/gtest.h>

#include <cmath>
#include <cstring>
#include <map>
#include <random>
#include <string>
#include <vector>

#include "gpureg/loop_closure.hpp"
#include "support/registration_result.hpp"

namespace gpureg::test {

using loop_closure::FragmentId;
using loop_closure::Loop;
using loop_closure::LoopCloser;
using loop_closure::LoopReason;
using loop_closure::LoopState;
using loop_closure::Update;
using Pose = UnalignedIsometry3d;
using pose_graph::UnalignedMatrix6d;

inline Pose planar(double x, double y, double degrees) {
  Pose pose = Pose::Identity();
  pose.linear() =
      Eigen::AngleAxisd(degrees * M_PI / 180, Eigen::Vector3d::UnitZ()).toRotationMatrix();
  pose.translation() = Eigen::Vector3d(x, y, 0);
  return pose;
}

/// Laps around a square of `side` metres with `per_side` fragments on each side: true poses.
inline std::vector<Pose> square(int fragments, int per_side = 5, double side = 5) {
  std::vector<Pose> poses;
  for (int k = 0; k < fragments; ++k) {
    const int leg = (k / per_side) % 4;
    const double along = side * (k % per_side) / per_side;
    const Pose corner = planar(leg == 1 || leg == 2 ? side : 0, leg >= 2 ? side : 0, 90.0 * leg);
    poses.push_back(corner * planar(along, 0, 0));
  }
  return poses;
}

/// The same as odometry sees it: every step turned a little to one side and a little too long.
inline std::vector<Pose> drifted(const std::vector<Pose>& truth, double degrees_per_metre = 0.3,
                                 double scale = 1.02) {
  std::vector<Pose> out{truth[0]};
  for (std::size_t k = 1; k < truth.size(); ++k) {
    Pose step = truth[k - 1].inverse() * truth[k];
    step.translation() *= scale;
    out.push_back(out.back() * step * planar(0, 0, degrees_per_metre * step.translation().norm()));
  }
  return out;
}

/// A sequence of fragments without clouds, whose registrations the test makes up.
struct Sequence {
  std::vector<Pose> truth, odometry;
  FragmentId first = 0;
  std::int64_t session = 0;

  FragmentId id(int k) const { return first + k; }

  void add_to(LoopCloser& closer, int begin = 0, int end = -1) const {
    if (end < 0) end = static_cast<int>(truth.size());
    for (int k = begin; k < end; ++k) {
      const auto at = static_cast<std::size_t>(k);
      loop_closure::Fragment fragment;
      fragment.id = id(k);
      fragment.session = session;
      fragment.time = k;
      fragment.world_from_fragment = odometry[at];
      closer.add(fragment);
      if (k > 0) closer.add_odometry(id(k), id(k - 1), odometry[at - 1].inverse() * odometry[at]);
    }
  }
};

inline Sequence sequence(std::vector<Pose> truth, FragmentId first = 0, std::int64_t session = 0) {
  Sequence out;
  out.odometry = drifted(truth);
  out.truth = std::move(truth);
  out.first = first;
  out.session = session;
  return out;
}

/// A correct result with an error of some millimetres.
inline RegistrationResult correct(const Pose& world_from_source, const Pose& world_from_target,
                                  double confidence) {
  Pose pose = world_from_target.inverse() * world_from_source;
  pose.translation().x() += 0.004;
  return result_of(pose, confidence);
}

inline void add_correct(LoopCloser& closer, const Sequence& s, int source, int target,
                        double confidence) {
  closer.add_result(s.id(source), s.id(target),
                    correct(s.truth[static_cast<std::size_t>(source)],
                            s.truth[static_cast<std::size_t>(target)], confidence));
}

/// The only loop of a pair.
inline Loop loop_of(const std::vector<Loop>& loops, FragmentId source, FragmentId target) {
  for (const Loop& loop : loops)
    if (loop.source == source && loop.target == target) return loop;
  ADD_FAILURE() << "no loop of " << source << " and " << target;
  return {};
}

inline bool has_loop(const std::vector<Loop>& loops, FragmentId source, FragmentId target) {
  for (const Loop& loop : loops)
    if (loop.source == source && loop.target == target) return true;
  return false;
}

inline LoopCloser closer_of(const loop_closure::Options& options = {}) {
  return LoopCloser(Context::cpu(1), options);
}

/// Largest distance of the poses of one sequence to its truth, in the frame of its first fragment.
inline double largest_error(const std::vector<loop_closure::FragmentPose>& poses,
                            const Sequence& s) {
  std::map<FragmentId, Pose> by_id;
  for (const loop_closure::FragmentPose& pose : poses) by_id[pose.id] = pose.world_from_fragment;
  double largest = 0;
  for (std::size_t k = 0; k < s.truth.size(); ++k) {
    const Pose truth = s.truth[0].inverse() * s.truth[k];
    const Pose found = by_id.at(s.first).inverse() * by_id.at(s.id(static_cast<int>(k)));
    largest = std::max(largest, (truth.translation() - found.translation()).norm());
  }
  return largest;
}

/// Distance between the relative pose of two fragments and the true one, metres.
inline double relative_error(const std::vector<loop_closure::FragmentPose>& poses,
                             const Sequence& s, int a, int b) {
  Pose found_a, found_b;
  for (const loop_closure::FragmentPose& pose : poses) {
    if (pose.id == s.id(a)) found_a = pose.world_from_fragment;
    if (pose.id == s.id(b)) found_b = pose.world_from_fragment;
  }
  const Pose truth =
      s.truth[static_cast<std::size_t>(a)].inverse() * s.truth[static_cast<std::size_t>(b)];
  return ((found_a.inverse() * found_b).translation() - truth.translation()).norm();
}

/// Every number of a closer's results, for comparison by bytes.
inline std::string bytes_of(const LoopCloser& closer) {
  std::string bytes;
  const auto add = [&](double value) {
    char raw[sizeof value];
    std::memcpy(raw, &value, sizeof value);
    bytes.append(raw, sizeof raw);
  };
  const auto add_pose = [&](const Pose& pose) {
    for (int k = 0; k < 16; ++k) add(pose.matrix().data()[k]);
  };
  for (const Loop& loop : closer.loops()) {
    add(static_cast<double>(loop.source));
    add(static_cast<double>(loop.target));
    add(static_cast<double>(loop.state));
    add(static_cast<double>(loop.reason));
    add(loop.confidence);
    add(loop.weight);
    add(loop.drift_ratio);
    add_pose(loop.target_from_source);
    for (int k = 0; k < 36; ++k) add(loop.information.data()[k]);
  }
  for (const loop_closure::FragmentPose& pose : closer.poses()) {
    add(static_cast<double>(pose.id));
    add(static_cast<double>(pose.frame));
    add_pose(pose.world_from_fragment);
  }
  return bytes;
}

}  // namespace gpureg::test
