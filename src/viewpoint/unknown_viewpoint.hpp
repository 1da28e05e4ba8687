// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <memory>
#include <vector>

#include "pipeline/engine.hpp"

namespace gpureg {

/// What the caller said about the viewpoints of a cloud.
struct CloudKnowledge {
  bool viewpoints, normals, features;  ///< given
  bool infer_viewpoint;                ///< PointCloudView::infer_viewpoint
  bool model;                          ///< PointCloudView::model
};

template <typename View>
CloudKnowledge knowledge_of(const View& view) {
  return {view.viewpoint_count > 0, view.normals != nullptr, view.features != nullptr,
          view.infer_viewpoint, view.model};
}

/// @throws InvalidArgument for a given viewpoint that is so far from the cloud that its rays mean
///   nothing. The origin of a cloud in map coordinates may be that far, as long as nobody gives it.
void check_viewpoints(const CloudKnowledge& knowledge, const PreparedState& state);

/// Sets PrepareStatistics::viewpoint of prepared clouds. Clouds whose sides turn out to be others
/// than the preparation took are replaced: prepared again from their prepared points, with the
/// right sides as input normals and no viewpoint, and once more with the other sides where both are
/// likely. The choice is made on the host, so that backends agree bit for bit.
/// @param raw rows of the points in host memory.
void resolve_viewpoints(Engine& engine, Span<const RawCloud> raw,
                        const std::vector<CloudKnowledge>& knowledge, const PrepareOptions& options,
                        std::vector<std::shared_ptr<PreparedState>>& states);

}  // namespace gpureg
