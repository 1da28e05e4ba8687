// SPDX-License-Identifier: BSD-3-Clause
#include "gpureg/options.hpp"

#include "fields/options.hpp"
#include "fields/validate.hpp"
#include "math/exponential.hpp"
#include "settings/resolve.hpp"

namespace gpureg {

const char* to_string(RegistrationMethod method) {
  return method == RegistrationMethod::quadruples ? "quadruples" : "compatibility";
}

void PrepareOptions::validate() const {
  fields::validate(*this);
  const auto at_most = [](float length, const char* name, float most, const char* what) {
    require(length <= most, name, length, what);
  };
  at_most(wide_feature_radius, "prepare.wide_feature_radius",
          limits::kMaxRadiusRatio * feature_radius, "at most 4 times prepare.feature_radius");
  at_most(normal_radius, "prepare.normal_radius", limits::kMaxRadiusRatio * feature_radius,
          "at most 4 times prepare.feature_radius");
  at_most(feature_radius, "prepare.feature_radius", limits::kMaxFeatureRadiusInVoxels,
          "at most 100 voxels");
  at_most(max_correspondence_distance, "prepare.max_correspondence_distance",
          limits::kMaxCorrespondenceInVoxels, "at most 20 voxels");
}

void ConfidenceCalibration::validate() const { fields::validate(*this); }
void RegistrationOptions::validate() const { resolve(*this); }

double ConfidenceCalibration::operator()(double confidence) const {
  if (is_identity() || confidence <= 0 || confidence >= 1) return confidence;
  const double log_odds = portable::log(confidence) - portable::log1p(-confidence);
  return portable::logistic(offset + slope * log_odds);
}

RegistrationOptions RegistrationOptions::loopsmart(float voxel_size) {
  RegistrationOptions o;
  o.voxel_size = voxel_size;
  o.min_confidence = 0.3;
  o.prepare.wide_feature_radius = 0;
  o.prepare.depth_maps = 0;
  o.prepare.surface_side_distance = 0;
  o.method = RegistrationMethod::quadruples;
  o.refine_iterations = 0;
  return o;
}

}  // namespace gpureg
