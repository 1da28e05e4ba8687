// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <thread>

#include "localization/map_state.hpp"

namespace gpureg::localization {

const MapState& MapState::of(const PreparedMap& map) {
  if (!map.valid()) throw InvalidArgument("map is an empty handle");
  return *map.state_;
}

unsigned host_threads(const Context& context) {
  return context.backend() == Backend::cpu ? context.threads()
                                           : std::max(1u, std::thread::hardware_concurrency());
}

std::size_t PreparedMap::size() const { return MapState::of(*this).points.size(); }
std::size_t PreparedMap::tiles() const { return MapState::of(*this).tiles.size(); }
const MapOptions& PreparedMap::options() const { return MapState::of(*this).given; }

PointCloud PreparedMap::cloud() const {
  const MapState& state = MapState::of(*this);
  PointCloud out;
  out.origin = state.origin;
  out.points = state.points;
  for (const Side& side : state.sides_inferred ? std::vector<Side>() : state.sides)
    out.normals.push_back(Eigen::Vector3i(side[0], side[1], side[2]).cast<float>().normalized());
  out.viewpoints = state.viewpoints;
  return out;
}

}  // namespace gpureg::localization
