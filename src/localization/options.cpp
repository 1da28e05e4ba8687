// SPDX-License-Identifier: BSD-3-Clause
#include <cmath>

#include "fields/localization.hpp"
#include "fields/scale.hpp"
#include "fields/validate.hpp"

namespace gpureg::localization {

MapOptions MapOptions::from_voxel_size(float voxel_size) {
  require(positive(voxel_size), "voxel_size", voxel_size, "a finite number > 0");
  MapOptions options;
  fields::scale(options, voxel_size);
  return options;
}

void MapOptions::validate() const {
  fields::validate(*this);
  require(prepare.voxel_size > 0, "prepare.voxel_size", prepare.voxel_size, "a length > 0");
}

LocateOptions LocateOptions::from_voxel_size(float voxel_size, std::uint32_t quality) {
  LocateOptions options;
  options.registration = RegistrationOptions::from_voxel_size(voxel_size, quality);
  options.neighborhood *= static_cast<double>(voxel_size) / fields::kDefaultVoxel;
  return options;
}

void LocateOptions::validate() const {
  fields::validate(*this);
  require(registration.method == RegistrationMethod::compatibility, "registration.method",
          to_string(registration.method), "compatibility: only it verifies poses by evidence");
  require(registration.calibration.is_identity(), "registration.calibration", "given",
          "none: it is of pairs, and the confidence of a place has a fit of its own");
}

ChangeOptions ChangeOptions::from_voxel_size(float voxel_size) {
  require(positive(voxel_size), "voxel_size", voxel_size, "a finite number > 0");
  ChangeOptions options;
  fields::scale(options, voxel_size);
  return options;
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

}  // namespace gpureg::localization
