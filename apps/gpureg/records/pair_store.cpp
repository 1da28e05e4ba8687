// SPDX-License-Identifier: BSD-3-Clause
#include "records/pair_store.hpp"

#include <cstdlib>
#include <mutex>

#include "gpureg/error.hpp"
#include "gpureg/sets/pair_journal.hpp"
#include "json/json_fields.hpp"
#include "json/json_file.hpp"
#include "records/pair_json.hpp"
#include "records/result_file.hpp"
#include "records/result_json.hpp"
#include "text.hpp"

namespace gpureg::cli {
namespace {

/// Tolerances belong to the voxel size of the results.
void check_voxel_size_of(float voxel_size, const std::string& path, float expected) {
  if (voxel_size != expected)
    throw InvalidArgument("--voxel-size is " + significant(static_cast<double>(expected), 4) +
                          ", but " + path + " was made with " +
                          significant(static_cast<double>(voxel_size), 4));
}

float voxel_size_in(const Json& document) {
  const Json::json_pointer place("/options/voxel_size");
  return document.contains(place) && document[place].is_number() ? document[place].get<float>() : 0;
}

std::uint32_t index_of_name(const FragmentFolder& folder, const std::string& name) {
  for (std::size_t k = 0; k < folder.scans.size(); ++k)
    if (folder.scans[k].name == name) return static_cast<std::uint32_t>(k);
  throw InvalidArgument("it names " + name + ", which the folder lacks");
}

/// Of a document whose pairs have names, these tell which scan a number is.
std::uint32_t index_of(const FragmentFolder& folder, const Json& pair, const char* number_name,
                       const char* name_name) {
  const int number = fragment_member(pair, number_name);
  if (const auto name = pair.find(name_name); name != pair.end() && name->is_string())
    return index_of_name(folder, name->get<std::string>());
  if (!folder.has(number))
    throw InvalidArgument("it names fragment " + std::to_string(number) +
                          ", which the folder lacks");
  return folder.index_of(number);
}

RegistrationResult stored_result(const Json& json) {
  RegistrationResult result = result_from_json(json);
  if (const auto found = json.find("information"); found != json.end() && !found->is_null())
    result.source_moments =
        CorrespondenceMoments::from_redwood(square_matrix<6>(*found, "information"));
  return result;
}

StoredPairs read_pairs_of_journal(const std::string& path, const FragmentFolder& folder,
                                  float voxel_size) {
  JournalContents journal = read_journal(path);
  for (const auto& [name, value] : journal.settings)
    if (name == "options.voxel_size")
      check_voxel_size_of(std::strtof(value.c_str(), nullptr), path, voxel_size);
  StoredPairs out{{}, std::move(journal.results)};
  try {
    for (const Pair& pair : journal.pairs)
      out.pairs.push_back({index_of_name(folder, journal.clouds[pair.source].name),
                           index_of_name(folder, journal.clouds[pair.target].name)});
  } catch (const InvalidArgument& error) {
    throw IoError(path + ": " + error.what());
  }
  return out;
}

}  // namespace

void write_pairs(const std::string& path, const Json& head, const std::vector<Pair>& pairs,
                 const std::function<RegistrationResult(std::size_t)>& result,
                 const FragmentFolder& folder, bool with_information) {
  std::vector<std::size_t> places;
  for (std::size_t k = 0; k < pairs.size(); ++k)
    if (result(k).status != RegistrationStatus::skipped) places.push_back(k);
  std::mutex reading;
  const auto result_at = [&](std::size_t k) {
    const std::lock_guard<std::mutex> lock(reading);
    return result(k);
  };
  const auto element = [&](std::size_t n) {
    const Pair& pair = pairs[places[n]];
    const RegistrationResult done = result_at(places[n]);
    const io::ScanFile &i = folder.scans[pair.target], &j = folder.scans[pair.source];
    Json json = {{"i", i.number}, {"j", j.number}, {"name_i", i.name}, {"name_j", j.name}};
    json.update(pair_to_json(i.number, j.number, done));
    if (with_information && done.has_pose())
      json["information"] = to_json(done.source_moments.information_redwood());
    return json;
  };
  write_document(path, head, {"pairs", places.size(), element});
}

StoredPairs read_pairs(const std::string& path, const FragmentFolder& folder, float voxel_size) {
  if (is_journal(path)) return read_pairs_of_journal(path, folder, voxel_size);
  DocumentFile file(path);
  StoredPairs out;
  const Json document = read_pairs(file, [&](const PairRecord&, Json&& json) {
    out.pairs.push_back(
        {index_of(folder, json, "j", "name_j"), index_of(folder, json, "i", "name_i")});
    out.results.push_back(stored_result(json));
  });
  if (document.contains("loop_consistency"))
    throw IoError(
        path + ": its confidences are those of `gpureg consistency`; give the JSON of the batch");
  if (document.contains("complete") && document["complete"] == false)
    throw IoError(path + ": is of an unfinished batch");
  if (const float of_pairs = voxel_size_in(document); of_pairs > 0)
    check_voxel_size_of(of_pairs, path, voxel_size);
  return out;
}

float voxel_size_of_pairs(const std::string& path) {
  if (is_journal(path))
    return std::strtof(PairJournal::setting(path, "options.voxel_size").c_str(), nullptr);
  DocumentFile file(path);
  return file.begins_object() ? voxel_size_in(file.read("pairs", [](Json&&) {})) : 0;
}

}  // namespace gpureg::cli
