// SPDX-License-Identifier: BSD-3-Clause
#include "records/pair_results.hpp"

#include <algorithm>
#include <set>
#include <utility>

#include "gpureg/error.hpp"
#include "gpureg/io.hpp"
#include "records/json_file.hpp"
#include "text.hpp"

namespace gpureg::cli {
namespace {

[[noreturn]] void fail(const std::string& path, const std::string& why) {
  throw IoError(path + ": " + why);
}

Json result_document(const std::string& path) {
  Json document;
  try {
    document = Json::parse(read_text(path));
  } catch (const Json::exception& error) {
    fail(path, error.what());
  }
  check_format(path, document);
  if (!document.is_object() || !document.contains("pairs") || !document["pairs"].is_array())
    fail(path, "is not the JSON of `gpureg batch` or of `gpureg reconstruct`");
  if (document.contains("loop_consistency"))
    fail(path, "its scores are those of `gpureg consistency`; give the JSON of the batch");
  if (document.contains("complete") && document["complete"] == false)
    fail(path, "is of an unfinished batch");
  return document;
}

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

}  // namespace

void read_pair_results(const std::string& path, MapRun& run) {
  for (auto& [number, file] : io::list_fragments(run.folder)) {
    run.scene.numbers.push_back(number);
    run.scene.files.push_back(file);
  }
  const Json document = result_document(path);
  check_voxel_size_of(document, path, run.options.prepare.voxel_size);
  std::set<std::pair<int, int>> seen;
  for (const Json& json : document["pairs"]) {
    const std::string where = "pairs[" + std::to_string(run.records.size()) + "]";
    try {
      run.records.push_back(PairRecord::from_json(json));
      const auto found = json.find("information");
      run.information.push_back(found == json.end() ? Json(nullptr) : *found);
      // Damage shall show here, with the entry, and not after the graph is made.
      result_from_record(run.records.back(), run.information.back());
    } catch (const InvalidArgument& error) {
      fail(path, where + ": " + error.what());
    } catch (const Json::exception& error) {
      fail(path, where + ": " + error.what());
    }
    const PairRecord& record = run.records.back();
    for (const int number : {record.i, record.j})
      if (!run.has(number))
        fail(path, where + " names fragment " + std::to_string(number) + ", which " + run.folder +
                       " lacks");
    if (record.i == record.j)
      fail(path, where + " is fragment " + std::to_string(record.i) + " with itself");
    if (!seen.insert(std::minmax(record.i, record.j)).second)
      fail(path, where + " repeats fragments " + std::to_string(record.i) + " and " +
                     std::to_string(record.j));
  }
}

}  // namespace gpureg::cli
