// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <deque>
#include <functional>
#include <future>
#include <memory>
#include <mutex>
#include <optional>
#include <vector>

#include "common/thread_group.hpp"
#include "pipeline/engine.hpp"
#include "viewpoint/viewpoint_inference.hpp"

namespace gpureg {

/// What the caller said about the viewpoints of a cloud.
struct CloudKnowledge {
  bool viewpoints, normals, features;  ///< given
  bool infer_viewpoint;                ///< PointCloudView::infer_viewpoint
  bool model;                          ///< PointCloudView::model
  double origin[3];                    ///< of the rows in the cloud's frame
  bool flat = false;                   ///< a scan of a 2-D scanner, in layers
};

template <typename View>
CloudKnowledge knowledge_of(const View& view) {
  return {view.viewpoint_count > 0,
          view.normals != nullptr,
          view.features != nullptr,
          view.infer_viewpoint,
          view.model,
          {view.origin[0], view.origin[1], view.origin[2]}};
}

/// @throws InvalidArgument for a given viewpoint that is so far from the cloud that its rays mean
///   nothing. The origin of a cloud in map coordinates may be that far, as long as nobody gives it.
void check_viewpoints(const CloudKnowledge& knowledge, const PreparedState& state);

/// The viewpoints of a batch of clouds that nobody gave. The choice is made on the host, so that
/// backends agree bit for bit.
class UnknownViewpoints {
 public:
  /// @param raw rows of the points in host memory, which have to outlive this.
  /// @param scales of clouds that are copies of one: one of them decides for all; otherwise none.
  UnknownViewpoints(Engine& engine, Span<const RawCloud> raw,
                    const std::vector<CloudKnowledge>& knowledge, const PrepareSettings& options,
                    std::vector<double> scales = {});

  /// Prepares the clouds [begin, end) as far as the sides that input or origin give. Where a device
  /// leaves the host idle, the host meanwhile decides about those whose surfaces are there.
  std::vector<std::shared_ptr<PreparedState>> prepare(std::size_t begin, std::size_t end);

  /// Sets PrepareStatistics::viewpoint of prepared clouds. Clouds whose sides turn out to be others
  /// than the preparation took are replaced: prepared again from their prepared points, with the
  /// right sides as input normals and no viewpoint, and once more with the other sides where both
  /// are likely.
  void resolve(std::vector<std::shared_ptr<PreparedState>>& states);

 private:
  struct Decision {
    bool made = false;
    PointsAndNormals surface;
    InferredSides sides;
  };
  bool is_open(std::size_t cloud) const;
  bool asks_rows(std::size_t cloud) const;
  void measure_rows(std::size_t cloud);
  void decide(std::size_t cloud, PointsAndNormals surface, const float (&origin)[3]);
  void decide_copies(const std::vector<std::shared_ptr<PreparedState>>& states,
                     const std::vector<std::size_t>& copies);
  void set_statistics(std::size_t cloud, PrepareStatistics& statistics) const;
  /// Works on another thread, after all works before.
  void meanwhile(std::function<void()> work);
  std::function<void()> next_work();
  ThreadGroup& threads();

  Engine& engine_;
  Span<const RawCloud> raw_;
  const std::vector<CloudKnowledge>& knowledge_;
  const PrepareSettings& options_;
  std::vector<double> scales_;
  std::vector<std::optional<SpacingSpread>> spread_;  ///< of each cloud, once measured
  std::vector<Decision> decisions_;                   ///< about each cloud
  std::unique_ptr<ThreadGroup> threads_;
  std::mutex mutex_;
  std::deque<std::function<void()>> waiting_;
  bool working_ = false;
  std::future<void> early_;  ///< last: it is waited for before the other members end
};

}  // namespace gpureg
