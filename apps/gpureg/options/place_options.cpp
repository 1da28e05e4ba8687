// SPDX-License-Identifier: BSD-3-Clause
#include "options/place_options.hpp"

#include <array>
#include <iostream>
#include <sstream>
#include <utility>

#include "gpureg/error.hpp"
#include "gpureg/voxel_size.hpp"
#include "run/spacing.hpp"
#include "text.hpp"

namespace gpureg::cli {
namespace {

/// "x,y,z,radius". Throws InvalidArgument.
std::optional<localization::PositionPrior> near_prior(const std::string& text) {
  if (text.empty()) return std::nullopt;
  std::array<double, 4> numbers{};
  std::stringstream stream(text);
  std::string field;
  std::size_t count = 0;
  bool good = true;
  while (std::getline(stream, field, ',')) {
    good = good && count < numbers.size() && read_number(field, numbers[count]);
    ++count;
  }
  if (!good || count != numbers.size())
    throw InvalidArgument("--near is '" + text + "', expected x,y,z,radius");
  return localization::PositionPrior{{numbers[0], numbers[1], numbers[2]}, numbers[3]};
}

}  // namespace

void PlaceOptions::add_to(Verb& verb) {
  verb.option("--viewpoint", viewpoint.text,
              "Where a scan was seen from: x,y,z in its frame; none: not known; auto: the file, or "
              "the origin if the surfaces agree with it")
      .show_default();
  up.add_to(verb, "scan and map", "the scan", "the map");
  verb.option("--near", near, "Rough position of a scan: x,y,z,radius in the map");
}

void PlaceOptions::check() const {
  viewpoint.check("--viewpoint");
  prior();
}

localization::LocatePrior PlaceOptions::prior() const {
  localization::LocatePrior prior;
  prior.gravity = up.prior();
  prior.position = near_prior(near);
  return prior;
}

namespace {

/// Clouds of a file, or some of a folder of scans with poses.
std::vector<PointCloud> sample_of(const std::string& path) { return MapInput(path).sample(); }

void choose_automatic(MethodOptions& method, const MapInput& input,
                      const std::vector<std::string>& scans) {
  constexpr std::size_t kMost = 8;  // scans that are asked
  std::vector<PointCloud> clouds;
  const std::size_t count = std::min(scans.size(), kMost);
  for (std::size_t k = 0; k < count; ++k)
    for (PointCloud& cloud : sample_of(scans[k * scans.size() / count]))
      clouds.push_back(std::move(cloud));
  const std::vector<PointCloud> of_map = input.sample();
  method.choose_voxel_size(views_of(scans.empty() ? of_map : clouds),
                           scans.empty() ? input.path : scans.front());
  if (const VoxelSizeSuggestion map = suggest_voxel_size(views_of(of_map)); map.valid())
    method.voxel_size = std::max(method.voxel_size, static_cast<float>(map.spacing));
}

}  // namespace

void choose_voxel_size(MethodOptions& method, const MapInput& input,
                       const std::vector<std::string>& scans) {
  if (!input.saved) {
    if (method.automatic_voxel_size) choose_automatic(method, input, scans);
    return;
  }
  const float of_map = input.saved->options().voxel_size;
  if (method.given("--voxel-size") && (method.automatic_voxel_size || method.voxel_size != of_map))
    throw InvalidArgument("--voxel-size is not that of " + input.path + ", which was made with " +
                          significant(static_cast<double>(of_map), 6));
  for (const std::string& assignment : method.set)
    if (assignment.rfind("prepare.", 0) == 0)
      throw InvalidArgument("--set " + assignment + " does nothing in " + input.path +
                            ": a saved map is prepared, and scans as it was");
  method.take_voxel_size(of_map);
}

localization::LocateOptions locate_options(const MethodOptions& method) {
  localization::LocateOptions options{method.registration()};
  // The default of pairs is not that of places. Here and in the JSON there is one threshold.
  if (method.sets_confidence()) options.min_confidence = options.registration.min_confidence;
  options.registration.min_confidence = options.min_confidence;
  options.validate();
  return options;
}

}  // namespace gpureg::cli
