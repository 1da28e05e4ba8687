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
  std::string up, near;

  void add_to(Verb& verb);
  /// @throws InvalidArgument naming option and text.
  void check() const;
  localization::LocatePrior prior() const;
};

/// Voxel size of a saved map, or what the options say.
/// @throws InvalidArgument where they contradict each other.
void choose_voxel_size(MethodOptions& method, const MapInput& input);

/// With the confidence that --min-score or --set asks for, if one does.
localization::LocateOptions locate_options(const MethodOptions& method);

}  // namespace gpureg::cli
