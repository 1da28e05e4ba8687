// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <cmath>
#include <memory>
#include <utility>

#include "api/access.hpp"
#include "common/for_each_on.hpp"
#include "gpureg/reconstruction/scales.hpp"
#include "math/exponential.hpp"
#include "reconstruction/scales/similarity_graph.hpp"
#include "scale/limits.hpp"
#include "scale/prepared_surface.hpp"
#include "settings/resolve.hpp"

namespace gpureg::reconstruction {
namespace {

/// Maps at most, before the last one.
constexpr int kMapsBefore = 2;
/// A scale that differs by more from the one of the map is that of another pose.
constexpr double kMostOfEdge = 0.1;

/// The edge with a free scale, from its pose in the map's set.
SimilarityEdge edge_of(const Edge& edge, const scale::RefinedScale& refined) {
  SimilarityEdge out;
  out.source = edge.source;
  out.target = edge.target;
  out.target_from_source = edge.target_from_source;
  out.centre = edge.overlap_centre;
  out.information = edge.information;
  const bool known = refined.points > 0 && refined.stiffness >= scale::kLeastStiffness &&
                     std::abs(refined.factor - 1) <= kMostOfEdge;
  const double deviation = known ? scale::kOwnScale : kMostOfEdge;
  if (known) out.log_scale = portable::log(refined.factor);
  out.scale_information = 1 / (deviation * deviation);
  return out;
}

/// The factors by which the scales of the scans of a map change.
std::vector<double> refined_factors(const Context& context, const MapOfSet& made,
                                    const RegistrationOptions& registration) {
  const Reconstruction& map = made.map;
  const RegistrationSettings settings = resolve(registration);
  std::vector<const Edge*> edges;
  std::vector<char> used(map.scans.size(), 0);
  for (const Edge& edge : map.edges)
    if (edge.accepted && map.scans[edge.source].placed && map.scans[edge.target].placed &&
        map.scans[edge.source].island == map.scans[edge.target].island) {
      edges.push_back(&edge);
      used[edge.source] = used[edge.target] = 1;
    }
  const std::size_t threads = Access::engine(context)->host_threads();
  std::vector<std::unique_ptr<scale::PreparedSurface>> surfaces(map.scans.size());
  for_each_on(threads, surfaces.size(), [&](std::size_t k) {
    if (used[k])
      surfaces[k] = std::make_unique<scale::PreparedSurface>(
          made.prepared[k].cloud, scale::kReach * settings.prepare.max_correspondence_distance);
  });
  std::vector<SimilarityEdge> graph(edges.size());
  for_each_on(threads, edges.size(), [&](std::size_t k) {
    const Edge& edge = *edges[k];
    graph[k] =
        edge_of(edge, scale::refine_scale(*surfaces[edge.source], *surfaces[edge.target],
                                          edge.target_from_source, settings.refine.kernel_width));
  });
  std::vector<Similarity> nodes(map.scans.size());
  std::vector<char> held(map.scans.size(), 0);
  for (const Island& island : map.islands) held[island.scans.front()] = 1;
  for (std::size_t k = 0; k < nodes.size(); ++k)
    if (map.scans[k].placed) nodes[k].rigid = map.scans[k].island_from_scan;
  std::vector<double> out(nodes.size(), 1.0);
  if (solve_similarities(graph, held, nodes))
    for (std::size_t k = 0; k < nodes.size(); ++k) out[k] = nodes[k].scale;
  return out;
}

}  // namespace

ScaledMapOfSet reconstruct_scaled(const Context& context, const FragmentSet& fragments,
                                  const std::vector<double>& scales, const MapInput& input,
                                  const MapOptions& options, const MapCallbacks& callbacks) {
  if (input.results)
    throw InvalidArgument(
        "results: of pairs of other scales; expected none where scans have scales");
  if (!options.journal.empty())
    throw InvalidArgument("journal is " + options.journal +
                          ", expected none where scans have scales");
  MapOptions coarse = options;
  coarse.with_refinement = coarse.with_surfaces = false;
  MapCallbacks quiet;
  quiet.on_progress = callbacks.on_progress;
  quiet.should_stop = callbacks.should_stop;
  ScaledMapOfSet out;
  out.scales = scales;
  for (bool settled = false; !settled && out.rounds < kMapsBefore; ++out.rounds) {
    out.made = reconstruct(context, ScaledFragments(fragments, out.scales), input, coarse, quiet);
    const std::vector<double> factors = refined_factors(context, out.made, options.registration);
    settled = true;
    for (std::size_t k = 0; k < factors.size(); ++k) {
      settled = settled && std::abs(factors[k] - 1) < scale::kSettled;
      out.scales[out.made.scans[k]] *= factors[k];
    }
  }
  out.made =
      reconstruct(context, ScaledFragments(fragments, out.scales), input, options, callbacks);
  ++out.rounds;
  return out;
}

}  // namespace gpureg::reconstruction
