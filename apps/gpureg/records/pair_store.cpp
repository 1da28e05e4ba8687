// SPDX-License-Identifier: BSD-3-Clause
#include "records/pair_store.hpp"

#include <algorithm>

#include "gpureg/error.hpp"
#include "json/json_fields.hpp"
#include "json/json_file.hpp"
#include "records/pair_json.hpp"
#include "records/result_file.hpp"
#include "records/result_json.hpp"
#include "text.hpp"

namespace gpureg::cli {
namespace {

/// Tolerances belong to the voxel size of the results.
void check_voxel_size_of(const Json& document, const std::string& path, float expected) {
  const Json::json_pointer place("/options/prepare/voxel_size");
  if (!document.contains(place) || !document[place].is_number()) return;
  const auto voxel_size = document[place].get<float>();
  if (voxel_size != expected)
    throw InvalidArgument("--voxel-size is " + significant(static_cast<double>(expected), 4) +
                          ", but " + path + " was made with " +
                          significant(static_cast<double>(voxel_size), 4));
}

/// Of a document whose pairs have names, these tell which scan a number is.
std::uint32_t index_of(const FragmentFolder& folder, const Json& pair, const char* number_name,
                       const char* name_name) {
  const int number = fragment_member(pair, number_name);
  if (const auto name = pair.find(name_name); name != pair.end() && name->is_string()) {
    const auto text = name->get<std::string>();
    for (std::size_t k = 0; k < folder.scans.size(); ++k)
      if (folder.scans[k].name == text) return static_cast<std::uint32_t>(k);
    throw InvalidArgument("it names " + text + ", which the folder lacks");
  }
  if (!folder.has(number))
    throw InvalidArgument("it names fragment " + std::to_string(number) +
                          ", which the folder lacks");
  return folder.index_of(number);
}

bool is_unusable(const FragmentFolder& folder, const Json& pair, int number,
                 const char* name_name) {
  const auto name = pair.find(name_name);
  if (name == pair.end() || !name->is_string()) return folder.is_unusable(number);
  return std::any_of(folder.unusable.begin(), folder.unusable.end(),
                     [&](const UnusableFragment& scan) { return scan.scan.name == *name; });
}

RegistrationResult stored_result(const Json& json) {
  RegistrationResult result = result_from_json(json);
  if (const auto found = json.find("information"); found != json.end() && !found->is_null())
    result.source_moments =
        CorrespondenceMoments::from_redwood(square_matrix<6>(*found, "information"));
  return result;
}

}  // namespace

std::vector<std::size_t> PairStore::all_done() const {
  std::vector<std::size_t> places;
  for (std::size_t k = 0; k < pairs.size(); ++k)
    if (done(k)) places.push_back(k);
  return places;
}

void write_pairs(const std::string& path, const Json& head, const PairStore& store,
                 const FragmentFolder& folder, bool with_information) {
  const std::vector<std::size_t> places = store.all_done();
  const auto element = [&](std::size_t n) {
    const Pair& pair = store.pairs[places[n]];
    const RegistrationResult& result = store.results[places[n]];
    const io::ScanFile &i = folder.scans[pair.target], &j = folder.scans[pair.source];
    Json json = {{"i", i.number}, {"j", j.number}, {"name_i", i.name}, {"name_j", j.name}};
    json.update(pair_to_json(i.number, j.number, result));
    if (with_information && result.has_candidate)
      json["information"] = to_json(result.source_moments.information_redwood());
    return json;
  };
  write_document(path, head, {"pairs", places.size(), element});
}

PairStore read_pairs(const std::string& path, const FragmentFolder& folder, float voxel_size) {
  DocumentFile file(path);
  PairStore store;
  const Json document = read_pairs(file, [&](const PairRecord& pair, Json&& json) {
    if (is_unusable(folder, json, pair.i, "name_i") || is_unusable(folder, json, pair.j, "name_j"))
      return;
    store.pairs.push_back(
        {index_of(folder, json, "j", "name_j"), index_of(folder, json, "i", "name_i")});
    store.results.push_back(stored_result(json));
  });
  if (document.contains("loop_consistency"))
    throw IoError(path +
                  ": its scores are those of `gpureg consistency`; give the JSON of the batch");
  if (document.contains("complete") && document["complete"] == false)
    throw IoError(path + ": is of an unfinished batch");
  check_voxel_size_of(document, path, voxel_size);
  return store;
}

void reduce_moments(RegistrationResult& result) {
  result.source_moments =
      CorrespondenceMoments::from_redwood(result.source_moments.information_redwood());
  result.target_moments = {};
}

}  // namespace gpureg::cli
