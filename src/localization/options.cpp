// SPDX-License-Identifier: BSD-3-Clause
#include <cmath>

#include "fields/in_units.hpp"
#include "fields/localization.hpp"
#include "fields/validate.hpp"
#include "localization/settings.hpp"
#include "settings/resolve.hpp"

namespace gpureg::localization {

MapSettings resolve(const MapOptions& options) {
  fields::validate(options);
  return {gpureg::resolve(options.prepare, options.voxel_size),
          fields::length_of(options.tile_size, options.voxel_size),
          fields::length_of(options.halo, options.voxel_size)};
}

void MapOptions::validate() const { resolve(*this); }

LocateSettings resolve(const LocateOptions& options) {
  options.validate();
  return {options.registration,
          gpureg::resolve(options.registration),
          options.min_confidence,
          options.coarse_factor,
          options.coarse_tiles,
          options.fine_tiles,
          options.candidates,
          fields::length_of(options.neighborhood, options.registration.voxel_size)};
}

RegistrationSettings LocateSettings::registration_at(double factor) const {
  RegistrationOptions wider = options;
  wider.voxel_size *= static_cast<float>(factor);
  return gpureg::resolve(wider);
}

void LocateOptions::validate() const {
  fields::validate(*this);
  require(registration.method == RegistrationMethod::compatibility, "registration.method",
          to_string(registration.method), "compatibility: only it verifies poses by evidence");
  require(registration.calibration.is_identity(), "registration.calibration", "given",
          "none: it is of pairs, and the confidence of a place has a fit of its own");
}

void ChangeOptions::validate() const { fields::validate(*this); }

void LocatePrior::validate(const std::string& name) const {
  RegistrationPrior pair;
  pair.gravity = gravity;
  pair.validate(name);
  if (!position) return;
  for (const double coordinate : position->position)
    require(std::abs(coordinate) <= limits::kMaxCoordinate, (name + ".position.position").c_str(),
            coordinate, "coordinates of at most 1e12");
  require(position->radius > 0 && position->radius <= fields::kMost,
          (name + ".position.radius").c_str(), position->radius, "a finite number > 0");
}

const char* to_string(LocateStatus status) {
  switch (status) {
    case LocateStatus::found:
      return "found";
    case LocateStatus::ambiguous:
      return "ambiguous";
    case LocateStatus::not_found:
      return "not_found";
  }
  return "unknown";
}

const char* to_string(SearchStage stage) {
  switch (stage) {
    case SearchStage::from_above:
      return "from_above";
    case SearchStage::coarse_tiles:
      return "coarse_tiles";
    case SearchStage::tiles:
      return "tiles";
  }
  return "unknown";
}

}  // namespace gpureg::localization
