// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <limits>
#include <vector>

#include "common/thread_group.hpp"
#include "math/vec3.hpp"
#include "viewpoint/contradictions.hpp"
#include "viewpoint/surface_edges.hpp"

namespace gpureg {

/// Neighbouring points of a prepared cloud and the angle of their normals. Neighbours on a smooth
/// surface show the same side to a sensor; the graph counts where a choice of sides contradicts
/// that. Host only; deterministic.
class SurfaceGraph {
 public:
  /// A choice of sides: +1 keeps the normal of a point, -1 flips it.
  using Signs = std::vector<std::int8_t>;

  /// @param normals unit vectors of any sign; zero where unknown, such points have no neighbours.
  /// @param radius largest distance of neighbours, in the unit of the points.
  /// @param threads that share the work of the graph, which does not depend on their number; they
  ///   have to outlive it.
  SurfaceGraph(std::vector<Vec3> points, std::vector<Vec3> normals, float radius,
               ThreadGroup& threads);

  ThreadGroup& threads() const { return *threads_; }

  const std::vector<Vec3>& points() const { return points_; }
  const std::vector<Vec3>& normals() const { return normals_; }
  std::size_t edges() const { return edges_.size(); }
  float radius() const { return radius_; }

  /// Normal-weighted share of the edges whose ends show a viewpoint different sides, [0, 1]. Edges
  /// at grazing incidence weigh less: noise turns their normals to either side.
  double contradiction(Vec3 viewpoint) const { return contradictions({viewpoint})[0]; }
  /// The same for each of several viewpoints, which takes little more time than for one.
  /// @param limit shares above it may be infinite instead, which takes less time.
  std::vector<double> contradictions(const std::vector<Vec3>& viewpoints,
                                     double limit = std::numeric_limits<double>::infinity()) const;
  /// The same share for a choice of sides, without incidence.
  double contradiction(const Signs& signs) const;

  /// The side of every point that a viewpoint sees.
  Signs signs_towards(Vec3 viewpoint) const;
  /// Sides that agree along the surface: propagated over the minimum spanning forest of the angles
  /// between neighbouring normals (Hoppe et al. 1992, section 3.3). The normal of the first point
  /// of each connected part keeps its sign.
  Signs consistent_signs() const;
  /// Length of the mean of the normals with these signs: 0 for a closed surface.
  double flux(const Signs& signs) const;
  /// True where the normals of a closed surface point outwards: its enclosed volume is positive.
  bool outwards(const Signs& signs) const;

 private:
  void choose_counted();

  std::vector<Vec3> points_, normals_;
  std::vector<SurfaceEdge> edges_;
  float radius_;
  ThreadGroup* threads_;
  CountedEdges counted_;                     ///< those that contradictions() reads
  std::vector<std::uint32_t> counted_ends_;  ///< places in points_
};

}  // namespace gpureg
