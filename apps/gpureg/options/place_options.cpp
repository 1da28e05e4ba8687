// SPDX-License-Identifier: BSD-3-Clause
#include "options/place_options.hpp"

#include <array>
#include <sstream>

#include "gpureg/error.hpp"
#include "inputs/cloud_file.hpp"
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
  verb.option("--up", up,
              "Vertical direction x,y,z in scan and map, and perhaps how many degrees it may be "
              "off (without: 10): 0,0,1,5");
  verb.option("--near", near, "Rough position of a scan: x,y,z,radius in the map");
}

void PlaceOptions::check() const {
  viewpoint.check("--viewpoint");
  prior();
}

localization::LocatePrior PlaceOptions::prior() const {
  localization::LocatePrior prior;
  prior.gravity = up_prior(up);
  prior.position = near_prior(near);
  return prior;
}

void choose_voxel_size(MethodOptions& method, const MapInput& input) {
  if (!input.saved) {
    if (method.automatic_voxel_size && input.kind == MapInput::Kind::cloud)
      method.choose_voxel_size({read_cloud(input.path, 0, MeshNote::none).view()}, input.path);
    else if (method.automatic_voxel_size)
      throw InvalidArgument("--voxel-size auto is for a map that is one cloud; give the size");
    return;
  }
  const float of_map = input.saved->options().prepare.voxel_size;
  if (method.given("--voxel-size") && (method.automatic_voxel_size || method.voxel_size != of_map))
    throw InvalidArgument("--voxel-size is not that of " + input.path + ", which was made with " +
                          significant(static_cast<double>(of_map), 6));
  for (const std::string& assignment : method.set)
    if (assignment.rfind("prepare.", 0) == 0)
      throw InvalidArgument("--set " + assignment + " does nothing in " + input.path +
                            ": a saved map is prepared, and scans as it was");
  method.voxel_size = of_map;
}

localization::LocateOptions locate_options(const MethodOptions& method) {
  auto options = localization::LocateOptions::from_voxel_size(method.voxel_size, method.quality);
  options.registration = method.registration();
  // The default of pairs is not that of places. Here and in the JSON there is one threshold.
  if (method.sets_confidence()) options.min_confidence = options.registration.min_confidence;
  options.registration.min_confidence = options.min_confidence;
  options.validate();
  return options;
}

}  // namespace gpureg::cli
