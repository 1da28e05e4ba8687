// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>

#include "gpureg/localization.hpp"
#include "inputs/map_input.hpp"
#include "options/knowledge_options.hpp"
#include "options/method_options.hpp"

namespace gpureg::cli {

/// What the user knows of scans that are looked for in a map.
struct PlaceOptions {
  ViewpointChoice viewpoint;
  UpChoice up;  // of scan and map
  std::string near;

  void add_to(Verb& verb);
  /// @throws InvalidArgument naming option and text.
  void check() const;
  localization::LocatePrior prior() const;
};

/// Voxel size of a saved map, or what the options say; auto: it suits the scans, and is not below
/// the spacing of the map. Without scans it suits the map.
/// @throws InvalidArgument where they contradict each other.
void choose_voxel_size(MethodOptions& method, const MapInput& input,
                       const std::vector<std::string>& scans);

/// With the confidence that --min-confidence or --set asks for, if one does.
localization::LocateOptions locate_options(const MethodOptions& method);

}  // namespace gpureg::cli
