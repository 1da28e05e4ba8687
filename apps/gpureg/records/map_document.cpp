// SPDX-License-Identifier: BSD-3-Clause
#include "records/map_document.hpp"

#include <algorithm>
#include <sstream>

#include "json/fields_json.hpp"
#include "json/json.hpp"
#include "records/audit_document.hpp"
#include "records/fragments_json.hpp"
#include "records/result_json.hpp"
#include "text.hpp"

namespace gpureg::cli {

Json pairs_head(const MapRun& run, const reconstruction::MapOfSet& made, const Context& context) {
  Json json;
  json["gpureg"] = "batch";
  json["environment"] = environment(context);
  json["options"] = to_json(run.options);
  json["folder"] = run.input.path;
  json["recursive"] = run.input.recursive;
  json["complete"] = true;
  const double rate =
      made.seconds.align > 0 ? static_cast<double>(made.aligned_here) / made.seconds.align : 0;
  json["seconds"] = {{"prepare", made.seconds.prepare},
                     {"align", made.seconds.align},
                     {"pairs_per_second", rate},
                     {"pairs_in_this_run", made.aligned_here}};
  json["fragments"] = fragments_json(run.scene, clouds_of(made.prepared));
  json["unusable"] = unusable_json(run.scene);
  return json;
}

Json map_document(const MapRun& run, const Context& context) {
  Json json;
  json["gpureg"] = "reconstruct";
  json["environment"] = environment(context);
  json["options"] = to_json(run.options);
  json["folder"] = run.input.path;
  json["recursive"] = run.input.recursive;
  json["seconds"] = {{"prepare", run.made.seconds.prepare},   {"prune", run.made.seconds.prune},
                     {"align", run.made.seconds.align},       {"graph", run.made.seconds.graph},
                     {"surfaces", run.made.seconds.surfaces}, {"refine", run.made.seconds.refine},
                     {"write", run.seconds_of_writing}};
  json["peak_memory_mib"] = peak_memory_mib();
  json["graph"] = pose_graph::to_string(run.made.map.status);
  json["refinement"] = nullptr;
  if (run.made.refinement)
    json["refinement"] = {{"pairs", run.made.refinement->pairs},
                          {"correspondences", run.made.refinement->correspondences},
                          {"iterations", run.made.refinement->iterations},
                          {"rejected_edges", run.made.refinement->rejected_edges},
                          {"initial_rmse", run.made.refinement->initial_rmse},
                          {"final_rmse", run.made.refinement->final_rmse}};
  json["islands"] = Json::array();
  for (const reconstruction::Island& island : run.made.map.islands) {
    Json numbers = Json::array();
    for (const std::uint32_t scan : island.scans) numbers.push_back(run.scene.numbers[scan]);
    json["islands"].push_back(std::move(numbers));
  }
  json["scans"] = Json::array();
  for (std::size_t k = 0; k < run.made.map.scans.size(); ++k) {
    const reconstruction::Scan& scan = run.made.map.scans[k];
    json["scans"].push_back(
        {{"id", run.scene.numbers[k]},
         {"name", run.scene.scans[k].name},
         {"placed", scan.placed},
         {"island", scan.placed ? Json(scan.island) : Json(nullptr)},
         {"island_from_scan", scan.placed ? to_json(run.island_from_scan(k)) : Json(nullptr)},
         {"scale", run.scale(k)},
         {"confidence", scan.confidence},
         {"reason", reconstruction::to_string(scan.reason)}});
  }
  json["unusable"] = unusable_json(run.scene);
  json["weakest_links"] = Json::array();
  for (const reconstruction::Link& link : reconstruction::weakest_links(run.made.map)) {
    Json numbers = Json::array();
    for (const std::uint32_t scan : link.scans) numbers.push_back(run.scene.numbers[scan]);
    json["weakest_links"].push_back({{"scans", std::move(numbers)},
                                     {"confidence", link.confidence},
                                     {"accepted", link.accepted},
                                     {"rejected", link.rejected}});
  }
  json["audit"] = run.made.audit ? audit_json(*run.made.audit, run.scene.scans) : Json(nullptr);
  json["places_look_alike"] = run.made.places_look_alike;
  json["agreement"] = {{"contradicted", run.made.map.agreement.contradicted},
                       {"edges_per_scan", run.made.map.agreement.edges_per_scan},
                       {"jumps", run.made.map.agreement.jumps}};
  json["edges"] = Json::array();
  for (const reconstruction::Edge& edge : run.made.map.edges)
    json["edges"].push_back(
        {{"i", run.scene.numbers[edge.target]},
         {"j", run.scene.numbers[edge.source]},
         {"name_i", run.scene.scans[edge.target].name},
         {"name_j", run.scene.scans[edge.source].name},
         {"T_ij", to_json(run.of_files(edge.source, edge.target, edge.target_from_source))},
         {"confidence", edge.confidence},
         {"pair_confidence", edge.pair_confidence},
         {"map_confidence", edge.map_confidence},
         {"weight", edge.weight},
         {"state", edge.accepted ? "accepted" : "rejected"},
         {"reason", reconstruction::to_string(edge.reason)},
         {"mode", edge.mode}});
  return json;
}

std::string map_summary(const MapRun& run, const Context& context) {
  std::ostringstream out;
  if (run.aligned_here)
    out << "fragments  " << run.scene.numbers.size() << ", prepared in "
        << fixed(run.made.seconds.prepare, 2) << " s\n"
        << "pairs      " << run.made.pairs.size() << ", in " << fixed(run.made.seconds.align, 2)
        << " s (" << context.description() << ")\n";
  out << unusable_line(run.scene);
  if (!run.scales.empty()) {
    const auto [least, most] = std::minmax_element(run.scales.begin(), run.scales.end());
    out << "scales     " << significant(*least, 4) << " to " << significant(*most, 4)
        << ", in the poses\n";
  }
  if (!run.made.map.odometry.empty())
    out << "odometry   " << run.made.map.odometry.size() << " poses\n";
  const std::size_t accepted = run.accepted_edges();
  out << "edges      " << accepted << " accepted, " << run.made.map.edges.size() - accepted
      << " rejected, in " << fixed(run.made.seconds.graph, 2) << " s\n"
      << "placed     " << run.made.map.placed() << " of " << run.made.map.scans.size()
      << ", islands of";
  for (const reconstruction::Island& island : run.made.map.islands)
    out << " " << island.scans.size();
  out << (run.made.map.islands.empty() ? " no scan\n" : " scans\n");
  if (run.made.audit)
    out << "audit      " << run.made.audit->pairs.size() << " pairs near each other, "
        << std::count_if(run.made.audit->pairs.begin(), run.made.audit->pairs.end(),
                         [](const reconstruction::AuditedPair& pair) {
                           return pair.verdict == reconstruction::PairVerdict::contradicts;
                         })
        << " contradict their poses\n";
  if (run.made.places_look_alike)
    out << "note       places look alike: only pairs along the path of the sensor were trusted\n";
  for (std::size_t k = 0; k < run.made.map.scans.size(); ++k)
    if (run.made.map.scans[k].reason != reconstruction::ScanReason::none)
      out << (run.made.map.scans[k].placed ? "note       " : "left out   ")
          << label(run.scene.scans[k]) << ": "
          << reconstruction::describe(run.made.map.scans[k].reason) << "\n";
  if (run.made.refinement)
    out << "refined    " << run.made.refinement->pairs << " overlapping pairs, RMS distance "
        << fixed(1000 * run.made.refinement->initial_rmse, 1) << " mm before, "
        << fixed(1000 * run.made.refinement->final_rmse, 1) << " mm after, in "
        << fixed(run.made.seconds.refine, 2) << " s\n";
  if (run.map_points > 0) out << "map        " << grouped(run.map_points) << " points\n";
  out << "memory     " << fixed(peak_memory_mib(), 0) << " MiB at most\n"
      << "written    to " << run.output << "\n";
  return out.str();
}

}  // namespace gpureg::cli
