// SPDX-License-Identifier: BSD-3-Clause
#include "inputs/scene_file.hpp"

#include <algorithm>
#include <cmath>
#include <unordered_set>

#include "gpureg/error.hpp"
#include "inputs/calibration_file.hpp"
#include "json/fields_json.hpp"

namespace gpureg::cli {
namespace {

/// Floats are written in full by some and as their shortest decimals by others.
bool same_value(const Json& a, const Json& b) {
  if (!a.is_number() || !b.is_number()) return a == b;
  const double x = a.get<double>(), y = b.get<double>();
  return std::abs(x - y) <= 1e-6 * std::max(std::abs(x), std::abs(y));
}

/// The first member of `now` that `before` lacks or has with another value; empty: none.
std::string first_difference(const Json& before, const Json& now) {
  for (const auto& item : now.items()) {
    const auto found = before.find(item.key());
    if (found == before.end()) return item.key();
    if (found->is_object() && item.value().is_object()) {
      const std::string inner = first_difference(*found, item.value());
      if (!inner.empty()) return item.key() + "." + inner;
    } else if (!same_value(*found, item.value())) {
      return item.key();
    }
  }
  return "";
}

}  // namespace

SceneFile read_scene(const std::string& path) {
  const Json document = read_calibration_document(path);
  const auto list = [&](const Json& parent, const char* field, bool (Json::*is)() const noexcept) {
    const Json values = parent.is_object() ? parent.value(field, Json::array()) : Json();
    const bool fine =
        values.is_array() && !values.empty() &&
        std::all_of(values.begin(), values.end(), [&](const Json& value) { return (value.*is)(); });
    return fine ? values : Json::array();
  };
  const Json pairs = document.value("decided_pairs", Json());
  const Json confidences = list(pairs, "confidence", &Json::is_number),
             correct = list(pairs, "correct", &Json::is_boolean),
             clouds = list(document, "clouds", &Json::is_number_unsigned);
  if (confidences.empty() || confidences.size() != correct.size())
    throw IoError(path + ": \"decided_pairs\" has no confidences and labels of pairs");
  SceneFile out{
      path, {}, clouds.get<std::vector<std::uint64_t>>(), document.value("options", Json())};
  if (out.clouds.empty() || !out.options.is_object())
    throw IoError(path +
                  ": \"clouds\" and \"options\" do not say of which clouds it was made, "
                  "and how");
  for (std::size_t k = 0; k < confidences.size(); ++k)
    out.pairs.push_back({confidences[k].get<double>(), correct[k].get<bool>()});
  return out;
}

Json scene_options(const RegistrationOptions& options) {
  Json json = to_json(options);
  for (const char* other : {"seed", "min_confidence", "accept_symmetry", "calibration"})
    json.erase(other);
  return json;
}

void check_different(const SceneFile& a, const SceneFile& b) {
  const std::unordered_set<std::uint64_t> of_a(a.clouds.begin(), a.clouds.end());
  const auto shared = std::count_if(b.clouds.begin(), b.clouds.end(),
                                    [&](std::uint64_t cloud) { return of_a.count(cloud) > 0; });
  if (shared > 0)
    throw InvalidArgument("--scenes: " + a.name + " and " + b.name + " have " +
                          std::to_string(shared) + (shared == 1 ? " cloud" : " clouds") +
                          " in common, so they are one scene");
}

void check_options(const SceneFile& scene, const Json& options) {
  if (const std::string name = first_difference(scene.options, options); !name.empty())
    throw InvalidArgument("--scenes: " + scene.name + " was made with another " + name +
                          " than this run, so its confidences are others");
}

}  // namespace gpureg::cli
