// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <functional>
#include <gpureg/loop_closure.hpp>
#include <utility>
#include <vector>

/// All that a SLAM system needs to get its loops from gpureg. Tracking hands over clouds, odometry
/// and what it has connected already; another thread registers and verifies; tracking takes up the
/// loops and gives its corrected poses back.
namespace slam_demo {

class DenseLoops {
 public:
  DenseLoops(const gpureg::Context& context, const gpureg::loop_closure::Options& options)
      : context_(context), options_(options), closer_(context, options) {}

  struct Fragment {
    gpureg::loop_closure::Fragment node;        ///< without its cloud
    std::function<gpureg::PointCloud()> cloud;  ///< called once, by process()
    std::vector<gpureg::loop_closure::FragmentId> covisible;
    /// Odometry: an earlier fragment, and its pose of this one.
    std::vector<std::pair<gpureg::loop_closure::FragmentId, gpureg::UnalignedIsometry3d>> odometry;
  };

  /// Tracking's thread: keeps a fragment for the next process().
  void add(Fragment fragment) { waiting_.push_back(std::move(fragment)); }

  /// Tracking's thread: what process() gets to do.
  std::vector<Fragment> take_waiting() { return std::exchange(waiting_, {}); }

  /// Another thread, one at a time: registers what the fragments propose. Loops whose state
  /// changed.
  std::vector<gpureg::loop_closure::Loop> process(std::vector<Fragment> fragments) {
    for (Fragment& f : fragments) {
      const gpureg::PreparedCloud cloud =
          gpureg::prepare(context_, f.cloud().view(), options_.registration);
      if (cloud.size() > 0) f.node.cloud = cloud;
      closer_.add(f.node);
      for (const auto& [before, before_from_this] : f.odometry)
        closer_.add_odometry(f.node.id, before, before_from_this);
      if (!f.covisible.empty()) closer_.set_covisible(f.node.id, f.covisible);
    }
    return closer_.process().changed;
  }

  /// Tracking's thread, while process() does not run: corrected poses of fragments that were added.
  void set_poses(const std::vector<gpureg::loop_closure::FragmentPose>& poses) {
    if (!poses.empty()) closer_.set_poses(poses);
  }

  /// Its place gets no more loops.
  void remove(gpureg::loop_closure::FragmentId id) { closer_.remove(id); }

  /// Fragments that process() has added and nobody has removed.
  std::size_t size() const { return closer_.size(); }

 private:
  const gpureg::Context context_;
  const gpureg::loop_closure::Options options_;
  gpureg::loop_closure::LoopCloser closer_;
  std::vector<Fragment> waiting_;
};

}  // namespace slam_demo
