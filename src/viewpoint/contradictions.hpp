// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <vector>

#include "math/vec3.hpp"

namespace gpureg {

/// Edges of a surface graph whose ends may show a viewpoint different sides.
struct CountedEdges {
  struct Edge {
    std::uint32_t a, b;  ///< places of the ends
    float weight;        ///< with the sign of the cosine of the normals
  };
  std::vector<Edge> edges;
  std::vector<Vec3> points, normals;  ///< of the ends
  std::vector<float> weight;          ///< half of the weights of the edges of each end
};

/// Number of viewpoints whose contradictions take the time of one.
std::size_t viewpoints_at_once();

/// Normal-weighted share of the edges whose ends show a viewpoint different sides, for each of
/// several viewpoints.
/// @param limit where all shares of viewpoints_at_once() are greater, they may be infinite: that
///   takes fewer edges.
void count_contradictions(const CountedEdges& counted, const Vec3* viewpoints, std::size_t count,
                          double limit, double* shares);

/// The side of every point that a viewpoint sees: 1 that of its normal, -1 the other one.
void find_signs_towards(Vec3 viewpoint, const std::vector<Vec3>& points,
                        const std::vector<Vec3>& normals, std::int8_t* signs);

}  // namespace gpureg
