// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "api/with_settings.hpp"
#include "gpureg/localization.hpp"

/// Options with their lengths in the unit of the map.
namespace gpureg::localization {

struct MapSettings {
  PrepareSettings prepare;
  double tile_size = 20, halo = 4;
};

struct LocateSettings {
  RegistrationOptions options;        ///< of the alignments
  RegistrationSettings registration;  ///< the same
  double min_confidence = 0.75;
  double coarse_factor = 2;
  std::uint32_t coarse_tiles = 8, fine_tiles = 4, candidates = 8;
  double neighborhood = 0.5;

  /// In voxels that are larger by a factor.
  RegistrationSettings registration_at(double factor) const;
};

/// @throws InvalidArgument naming field and value.
MapSettings resolve(const MapOptions& options);
LocateSettings resolve(const LocateOptions& options);

}  // namespace gpureg::localization
