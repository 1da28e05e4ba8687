// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <algorithm>
#include <optional>
#include <vector>

#include "common/host_threads.hpp"
#include "flat/extruded.hpp"
#include "pipeline/engine.hpp"
#include "sensor_fixed/known.hpp"
#include "sensor_fixed/range_shells.hpp"
#include "spacing/stray_points.hpp"
#include "viewpoint/unknown_viewpoint.hpp"

namespace gpureg {

/// Points from which another thread is worth its start.
inline constexpr std::size_t kRawPointsPerThread = 200'000;

/// The owners of the rows that the engine gets of a cloud: without points at the limits of the
/// range, 2-D scans in layers, without stray points.
struct EngineRows {
  WithoutRangeShells seen;
  Extruded extruded;
  WithoutStrayPoints kept;
  EngineRows(const RawCloud& raw, const CloudKnowledge& known, const PrepareSettings& options)
      : seen(raw, options.keep_range_limits || !has_sensor_frame(known)),
        extruded(seen.cloud(), known.model, options),
        kept(extruded.cloud(), options) {}
  /// Adds what the engine does not see to the prepared cloud.
  void describe(PreparedState& state) const {
    state.plane = extruded.plane();
    kept.count(state.statistics);
    extruded.count(state.statistics);
    seen.count(state.statistics);
  }
  EngineRows(const EngineRows&) = delete;
  EngineRows& operator=(const EngineRows&) = delete;
};

/// Replaces clouds by those that the engine gets.
/// @return the owners of the rows.
template <typename Naming>
std::vector<std::optional<EngineRows>> replace_rows(const Engine& engine,
                                                    const PrepareSettings& options,
                                                    const Naming& naming,
                                                    std::vector<CloudKnowledge>& knowledge,
                                                    std::vector<RawCloud>& raw) {
  std::vector<std::optional<EngineRows>> owners(raw.size());
  std::size_t points = 0;
  for (const RawCloud& cloud : raw) points += cloud.size;
  const std::size_t workers = std::min<std::size_t>(
      {std::max(1u, engine.host_threads()), raw.size(), 1 + points / kRawPointsPerThread});
  on_threads(workers, [&](std::size_t worker) {
    for (std::size_t k = worker; k < raw.size(); k += workers)
      naming(k, [&] {
        const EngineRows& rows = owners[k].emplace(raw[k], knowledge[k], options);
        raw[k] = rows.kept.cloud();
        knowledge[k].flat = rows.extruded.plane().exists();
        // The origin of the frame may be below the scanner.
        if (knowledge[k].flat && !knowledge[k].viewpoints && raw[k].viewpoints)
          for (int axis = 0; axis < 3; ++axis)
            knowledge[k].origin[axis] = -static_cast<double>(raw[k].viewpoints[axis]);
      });
  });
  return owners;
}

}  // namespace gpureg
