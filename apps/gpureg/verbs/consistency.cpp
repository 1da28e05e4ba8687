// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <iostream>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "command.hpp"
#include "gpureg/error.hpp"
#include "gpureg/loop_consistency.hpp"
#include "gpureg/options.hpp"
#include "json/json_file.hpp"
#include "options/output_path.hpp"
#include "records/result_file.hpp"
#include "records/result_json.hpp"

namespace gpureg::cli {
namespace {

struct ConsistencyOptions {
  std::string result, json, log;
  std::optional<float> voxel_size;  // none: the result's own
  std::optional<double> min_confidence;
};

double option_of(const Json& document, const char* name, double otherwise) {
  const auto options = document.find("options");
  if (options == document.end() || !options->is_object()) return otherwise;
  const auto found = options->find(name);
  return found != options->end() && found->is_number() ? found->get<double>() : otherwise;
}

LoopConsistencyOptions loop_consistency_options(const ConsistencyOptions& o, const Json& document) {
  if (o.voxel_size) {
    // The batch would have taken no other one either.
    RegistrationOptions{*o.voxel_size}.validate();
    return {*o.voxel_size};
  }
  const double voxel_size = option_of(document, "voxel_size", 0);
  if (voxel_size == 0) throw IoError(o.result + ": does not say the voxel size; give --voxel-size");
  return {static_cast<float>(voxel_size)};
}

RegistrationResult result_of(const PairRecord& record, const Json& json) {
  RegistrationResult result;
  if (record.transform) result.target_from_source.matrix() = *record.transform;
  result.confidence = record.confidence;
  result.modes = modes_from_json(json);
  return result;
}

/// Puts the confidence from all pairs beside the pair's own. The chosen mode is first, as
/// readers of results expect.
void make_consistent(const PairRecord& record, const PairConsistency& pair, double min_confidence,
                     Json& json) {
  json["loop_consistency"] = {{"confidence_alone", record.confidence},
                              {"mode", pair.mode},
                              {"loops", pair.loops},
                              {"path", pair.path}};
  if (!record.transform) return;
  const bool aligned = pair.confidence >= min_confidence;
  json["confidence"] = pair.confidence;
  json["status"] =
      to_string(aligned ? RegistrationStatus::aligned : RegistrationStatus::not_aligned);
  if (aligned != record.aligned) {
    const auto reason = aligned ? RegistrationReason::none : RegistrationReason::contradicts_loops;
    json["reason"] = to_string(reason);
    json["explanation"] = explain(reason);
    if (aligned) json.erase("explanation");
  }
  if (const auto modes = json.find("modes"); modes != json.end() && !modes->empty()) {
    std::rotate(modes->begin(), modes->begin() + pair.mode, modes->begin() + pair.mode + 1);
    Json& first = modes->front();
    const double alone = first["confidence"].get<double>();
    const double overlap = first.value("overlap_confidence", alone);
    first["confidence"] = pair.confidence;
    // Loops determine the correctness of a pose, not its overlap.
    first["overlap_confidence"] =
        alone > 0 ? pair.confidence * std::min(1.0, overlap / alone) : 0.0;
    json["T_ij"] = first["T_ij"];
  }
}

/// The pairs of a result, whose documents keep the members that only other programs know.
struct Input {
  Json document;
  std::vector<PairRecord> records;
  std::vector<Json> documents;
  std::vector<Pair> pairs;
  std::vector<RegistrationResult> results;
};

Input read_input(const std::string& path) {
  DocumentFile file(path);
  if (!file.begins_object()) throw IoError(path + ": is a log; loops need RESULT.json of a batch");
  Input input;
  bool done = false;
  input.document = read_pairs(file, [&](const PairRecord& record, Json&& json) {
    done |= json.contains("loop_consistency");
    input.records.push_back(record);
    input.pairs.push_back(
        {static_cast<std::uint32_t>(record.j), static_cast<std::uint32_t>(record.i)});
    input.results.push_back(result_of(record, json));
    input.documents.push_back(std::move(json));
  });
  // A second run would count the same loops as new evidence.
  if (done || input.document.contains("loop_consistency"))
    throw IoError(
        path +
        ": its confidences are those of `gpureg consistency` already; give the RESULT.json of "
        "the batch");
  return input;
}

int run(const ConsistencyOptions& o) {
  check_outputs({{"--json", o.json}, {"-o", o.log}}, {{"RESULT", o.result}});
  Input input = read_input(o.result);
  const LoopConsistencyOptions options = loop_consistency_options(o, input.document);
  const double min_confidence =
      o.min_confidence.value_or(option_of(input.document, "min_confidence", 0.5));
  std::vector<PairConsistency> consistency;
  try {
    consistency = loop_consistency(input.pairs, input.results, options);
  } catch (const InvalidArgument& error) {
    throw IoError(o.result + ": " + error.what());
  }

  int count = 0;
  std::size_t raised = 0, lowered = 0, changed = 0, before = 0;
  std::vector<evaluation::LogEntry> log;
  for (std::size_t k = 0; k < input.records.size(); ++k) {
    const PairRecord& record = input.records[k];
    make_consistent(record, consistency[k], min_confidence, input.documents[k]);
    const PairRecord after = record_from_json(input.documents[k]);
    count = std::max({count, record.i + 1, record.j + 1});
    raised += consistency[k].confidence > record.confidence;
    lowered += consistency[k].confidence < record.confidence;
    changed += consistency[k].mode != 0;
    before += record.aligned;
    if (after.aligned) log.push_back({after.i, after.j, 0, *after.transform});
  }
  for (const Json& fragment : input.document.value("fragments", Json::array()))
    if (const auto number = fragment.find("number");
        number != fragment.end() && number->is_number_integer())
      count = std::max(count, number->get<int>() + 1);
  for (evaluation::LogEntry& entry : log) entry.count = count;

  Json& document = input.document;
  document["loop_consistency"] = {{"closing_angle", options.closing_angle},
                                  {"closing_distance", options.closing_distance},
                                  {"min_confidence", min_confidence}};
  write_document(o.json, document, {"pairs", input.documents.size(), [&](std::size_t k) {
                                      return std::move(input.documents[k]);
                                    }});
  if (!o.log.empty()) evaluation::write_log(o.log, log);
  std::cout << "pairs      " << input.records.size() << ", " << raised << " raised, " << lowered
            << " lowered, " << changed << " with another pose\n"
            << "aligned    " << log.size() << ", " << before << " before\n";
  return kOk;
}

}  // namespace

void add_consistency(CommandLine& line) {
  const auto o = std::make_shared<ConsistencyOptions>();
  Verb verb = line.verb(
      "consistency",
      "Re-score the pairs of a batch by loops of three clouds and by paths between clouds");
  verb.option("RESULT", o->result, "RESULT.json of a batch").required();
  verb.option("--json", o->json, "The same with confidences and poses in view of all pairs")
      .required();
  verb.option("-o,--output", o->log, "Redwood log of the pairs that are aligned then");
  verb.option("--voxel-size", o->voxel_size,
              "Voxel size of the tolerances; default: that of the batch");
  verb.option("--min-confidence", o->min_confidence,
              "Report a pair from this confidence on; default: the batch's")
      .between(0.0, 1.0);
  verb.run([o] { return run(*o); });
}

}  // namespace gpureg::cli
