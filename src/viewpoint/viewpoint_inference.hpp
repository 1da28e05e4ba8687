// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "gpureg/statistics.hpp"
#include "pipeline/types.hpp"
#include "spacing/spacing_spread.hpp"
#include "viewpoint/surface_graph.hpp"

namespace gpureg {

/// Sides of the surfaces of a cloud whose viewpoints nobody gave.
struct InferredSides {
  ViewpointSource source = ViewpointSource::none;
  SurfaceGraph::Signs signs;  ///< of the normals of the graph; empty: keep them as they are
  bool sign_known = true;     ///< false: the opposite of all signs is as likely
};

/// Sides of a cloud without input normals. The surfaces of a scan show one side to its sensor. The
/// viewpoint that sees the fewest neighbours from different sides is searched; the origin is one if
/// it does nearly as well and other places do not, if the points are spaced as a scanner there
/// spaces them, or if the directions from there have one return each. A closed surface is a model.
/// @param origin of the cloud's frame, relative to the points.
/// @param rows of the input.
/// @param spread of the rows about the origin; null: the origin is known not to be a viewpoint.
/// @param may_be_model false: a closed surface is that of a room, as a 2-D scanner sees it.
InferredSides infer_sides(const SurfaceGraph& graph, Vec3 origin, const RawCloud& rows,
                          Vec3 origin_of_rows, const SpacingSpread* spread, bool may_be_model);

/// True where the rows are spaced as a scanner at the origin spaces them: no surface has to tell.
bool is_scanner(const SpacingSpread& spread);

/// Sides of a cloud whose input normals gave the graph its signs: they are kept, unless they
/// contradict each other far more than sides from a viewpoint or along the surface do. Those then
/// replace them, with the sign that most of the input normals have.
InferredSides check_given_sides(const SurfaceGraph& graph, bool may_be_model);

}  // namespace gpureg
