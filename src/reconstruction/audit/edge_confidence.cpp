// SPDX-License-Identifier: BSD-3-Clause
#include "reconstruction/audit/edge_confidence.hpp"

#include <algorithm>
#include <cstddef>
#include <limits>
#include <vector>

#include "reconstruction/connections.hpp"

namespace gpureg::reconstruction {
namespace {

/// Poses between islands are right less often than their confidence says: that the islands stay
/// apart means that others speak against them. Ratio of the odds, and the most that is left, where
/// places are distinct and where they look alike: there, of the poses above 0.9, 0 to 57 of 100
/// were right in six buildings. Chosen, and tested without each building, by
/// bench/accuracy/map_confidence.py.
struct Rejection {
  double ratio, most;
};
constexpr Rejection kOfDistinctPlaces = {1.0 / 4, 0.9}, kOfAlikePlaces = {1.0 / 12, 0.2};

bool between_islands(const Edge& edge, const Reconstruction& map) {
  const Scan &source = map.scans[edge.source], &target = map.scans[edge.target];
  return !source.placed || !target.placed || source.island != target.island;
}

/// The least confidence of the connections between the scans of each edge; 1 where there is none.
std::vector<double> weakest_between(const Audit& audit, const Reconstruction& map) {
  // Of each place in the order of the audit: the connection of the part that begins there, and
  // where the smallest part ends that holds it.
  constexpr std::size_t kNone = std::numeric_limits<std::size_t>::max();
  std::vector<std::size_t> place(map.scans.size(), kNone), begins(audit.order.size(), kNone),
      above(audit.order.size(), kNone);
  for (std::size_t k = 0; k < audit.order.size(); ++k) place[audit.order[k]] = k;
  for (std::size_t k = 0; k < audit.connections.size(); ++k) begins[audit.connections[k].first] = k;
  std::vector<std::size_t> open;
  for (std::size_t k = 0; k < begins.size(); ++k) {
    const auto ended = [&](std::size_t at) {
      return audit.connections[begins[at]].first + audit.connections[begins[at]].size <= k;
    };
    while (!open.empty() && ended(open.back())) open.pop_back();
    if (!open.empty()) above[k] = open.back();
    if (begins[k] != kNone) open.push_back(k);
  }
  std::vector<double> out(map.edges.size(), 1);
  for (std::size_t k = 0; k < map.edges.size(); ++k) {
    std::size_t a = place[map.edges[k].source], b = place[map.edges[k].target];
    // Whichever comes later in the order is not above the other one; above all is the root, kNone.
    while (a != b) {
      std::size_t& later = b == kNone || (a != kNone && a > b) ? a : b;
      if (begins[later] != kNone)
        out[k] = std::min(out[k], audit.connections[begins[later]].confidence);
      later = above[later];
    }
  }
  return out;
}

double odds_of(double confidence, const Rejection& rejection) {
  return confidence / (1 - std::min(confidence, kMostConfidence)) * rejection.ratio;
}

}  // namespace

double confidence_among_copies(double confidence) {
  const double odds = odds_of(confidence, kOfAlikePlaces);
  return odds / (1 + odds);
}

void judge_edges(const Audit& audit, const AuditOptions& options, bool places_look_alike,
                 Reconstruction& map) {
  const std::vector<double> weakest = weakest_between(audit, map);
  const Rejection& rejection = places_look_alike ? kOfAlikePlaces : kOfDistinctPlaces;
  for (std::size_t k = 0; k < map.edges.size(); ++k) {
    Edge& edge = map.edges[k];
    const double odds = odds_of(edge.confidence, rejection);
    const double margin = options.max_shift + options.max_shift_per_metre *
                                                  edge.target_from_source.translation().norm();
    if (between_islands(edge, map))
      edge.map_confidence = std::min(rejection.most, odds / (1 + odds));
    else if (deviation(edge, map, margin) == 0)
      edge.map_confidence = weakest[k];
    else
      edge.map_confidence = edge.confidence * (1 - weakest[k]);
  }
}

}  // namespace gpureg::reconstruction
