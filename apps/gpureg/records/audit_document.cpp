// SPDX-License-Identifier: BSD-3-Clause
#include "records/audit_document.hpp"

#include <sstream>

#include "json/json.hpp"
#include "records/fragments_json.hpp"
#include "records/result_json.hpp"
#include "text.hpp"

namespace gpureg::cli {
namespace {

using Scans = std::vector<io::ScanFile>;

Json pair_json(const reconstruction::AuditedPair& pair, const Scans& scans) {
  return {{"i", scans[pair.target].number},
          {"j", scans[pair.source].number},
          {"name_i", scans[pair.target].name},
          {"name_j", scans[pair.source].name},
          {"verdict", to_string(pair.verdict)},
          {"log_likelihood_ratio", pair.log_likelihood_ratio},
          {"overlap", pair.overlap},
          {"observed", pair.observed},
          {"free_space_violation", pair.violation},
          {"shift", pair.shift}};
}

/// First and last of consecutive ones.
std::vector<std::pair<int, int>> ranges_of(const std::vector<int>& numbers) {
  std::vector<std::pair<int, int>> out;
  for (const int number : numbers)
    if (!out.empty() && out.back().second + 1 == number)
      out.back().second = number;
    else
      out.push_back({number, number});
  return out;
}

std::vector<int> numbers_of(const std::vector<std::uint32_t>& places, const Scans& scans) {
  std::vector<int> out;
  for (const std::uint32_t k : places) out.push_back(scans[k].number);
  return out;
}

std::string labels_of(const std::vector<std::uint32_t>& places, const Scans& scans) {
  Scans of;
  for (const std::uint32_t k : places) of.push_back(scans[k]);
  return (of.size() == 1 ? "scan " : "scans ") + labels(of);
}

}  // namespace

std::string island_scans(const AuditRun& run, std::size_t island) {
  return labels_of(run.audit.islands[island].scans, run.scene.scans);
}

std::string describe(const AuditRun& run, const reconstruction::AuditedConnection& connection) {
  std::ostringstream out;
  out << labels_of(run.audit.scans_of(connection), run.scene.scans) << ": "
      << connection.contradicting << (connection.contradicting == 1 ? " pair" : " pairs")
      << " with the other scans contradict, " << connection.supporting << " agree";
  if (connection.contradictions.empty()) return out.str();
  const reconstruction::AuditedPair& worst = run.audit.pairs[connection.contradictions.front()];
  out << "; worst " << label(run.scene.scans[worst.target]) << " and "
      << label(run.scene.scans[worst.source]) << ": ";
  if (worst.violation > 0.1)
    out << fixed(100 * worst.violation, 0) << " % of what should be seen is in free space";
  else
    out << "the surfaces fit better " << fixed(100 * worst.shift, 0) << " cm away";
  return out.str();
}

Json audit_json(const reconstruction::Audit& audit, const Scans& scans) {
  Json json;
  json["verdict"] = to_string(audit.verdict());
  json["islands"] = Json::array();
  const std::vector<reconstruction::AuditVerdict> verdicts = audit.verdicts();
  for (std::size_t k = 0; k < verdicts.size(); ++k)
    json["islands"].push_back({{"scans", ranges_of(numbers_of(audit.islands[k].scans, scans))},
                               {"verdict", to_string(verdicts[k])}});
  json["connections"] = Json::array();
  json["confirmed"] = audit.count(reconstruction::ConnectionVerdict::confirmed);
  for (const reconstruction::AuditedConnection& connection : audit.connections) {
    if (connection.verdict == reconstruction::ConnectionVerdict::confirmed) continue;
    Json contradictions = Json::array();
    for (const std::size_t k : connection.contradictions)
      contradictions.push_back(
          {scans[audit.pairs[k].target].number, scans[audit.pairs[k].source].number});
    json["connections"].push_back(
        {{"scans", ranges_of(numbers_of(audit.scans_of(connection), scans))},
         {"island", connection.island},
         {"verdict", to_string(connection.verdict)},
         {"confidence", connection.confidence},
         {"supporting", connection.supporting},
         {"contradicting", connection.contradicting},
         {"contradictions", std::move(contradictions)}});
  }
  json["pairs"] = Json::array();
  for (const reconstruction::AuditedPair& pair : audit.pairs)
    if (pair.verdict != reconstruction::PairVerdict::silent)
      json["pairs"].push_back(pair_json(pair, scans));
  return json;
}

Json audit_document(const AuditRun& run, const Context& context) {
  Json json;
  json["gpureg"] = "audit";
  json["environment"] = environment(context);
  json["folder"] = run.input.path;
  json["poses"] = run.poses_file;
  json["voxel_size"] = run.options.voxel_size;
  json["seconds"] = run.seconds;
  json["fragments"] = Json::array();
  for (const io::ScanFile& scan : run.scene.scans)
    json["fragments"].push_back({{"number", scan.number}, {"name", scan.name}});
  json["missing"] = run.missing;
  json["near_pairs"] = run.audit.pairs.size();
  json.update(audit_json(run.audit, run.scene.scans));
  return json;
}

}  // namespace gpureg::cli
