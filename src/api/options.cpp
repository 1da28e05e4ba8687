// SPDX-License-Identifier: BSD-3-Clause
#include "gpureg/options.hpp"

#include "fields/options.hpp"
#include "fields/scale.hpp"
#include "fields/validate.hpp"
#include "math/exponential.hpp"

namespace gpureg {

const char* to_string(RegistrationMethod method) {
  return method == RegistrationMethod::quadruples ? "quadruples" : "compatibility";
}

void PrepareOptions::validate() const {
  fields::validate(*this);
  require(wide_feature_radius <= limits::kMaxRadiusRatio * feature_radius,
          "prepare.wide_feature_radius", wide_feature_radius,
          "at most 4 times prepare.feature_radius");
  require(voxel_size == 0.0f || feature_radius <= limits::kMaxFeatureRadiusInVoxels * voxel_size,
          "prepare.feature_radius", feature_radius, "at most 100 times prepare.voxel_size");
  require(normal_radius <= limits::kMaxRadiusRatio * feature_radius, "prepare.normal_radius",
          normal_radius, "at most 4 times prepare.feature_radius");
  require(voxel_size == 0.0f ||
              max_correspondence_distance <= limits::kMaxCorrespondenceInVoxels * voxel_size,
          "prepare.max_correspondence_distance", max_correspondence_distance,
          "at most 20 times prepare.voxel_size");
}

void QuadrupleOptions::validate() const { fields::validate(*this); }
void CompatibilityOptions::validate() const { fields::validate(*this); }
void EvidenceOptions::validate() const { fields::validate(*this); }
void RefineOptions::validate() const { fields::validate(*this); }
void ConfidenceCalibration::validate() const { fields::validate(*this); }
void RegistrationOptions::validate() const { fields::validate(*this); }

double ConfidenceCalibration::operator()(double confidence) const {
  if (is_identity() || confidence <= 0 || confidence >= 1) return confidence;
  const double log_odds = portable::log(confidence) - portable::log1p(-confidence);
  return portable::logistic(offset + slope * log_odds);
}

namespace {

/// Numbers of candidates by quality: points of the Pareto front of recall and time that
/// bench/pipeline/front.py measures (bench/results/front.json). More matches and seeds find more of
/// the difficult pairs, and more modes keep their poses.
struct Effort {
  std::uint32_t matches, seeds, triangles, modes;
};
constexpr Effort kEfforts[kHighestQuality + 1] = {
    {512, 64, 32, 6},      {1024, 64, 32, 8},     {2048, 128, 32, 12},  {2048, 256, 32, 16},
    {3072, 512, 32, 16},   {4096, 512, 32, 24},   {4096, 1024, 64, 24}, {4096, 1024, 64, 32},
    {4096, 2048, 128, 48}, {8192, 2048, 128, 48}, {8192, 8192, 384, 64}};

}  // namespace

RegistrationOptions RegistrationOptions::with_quality(std::uint32_t quality) const {
  require(quality <= kHighestQuality, "quality", quality, "0 to 10");
  RegistrationOptions o = *this;
  o.compatibility.max_matches = kEfforts[quality].matches;
  o.compatibility.seeds = kEfforts[quality].seeds;
  o.compatibility.triangles = kEfforts[quality].triangles;
  o.evidence.modes = kEfforts[quality].modes;
  return o;
}

RegistrationOptions RegistrationOptions::from_voxel_size(float voxel_size, std::uint32_t quality) {
  require(fields::kLength.contains(static_cast<double>(voxel_size)), "voxel_size", voxel_size,
          fields::kLength.expected);
  RegistrationOptions o = RegistrationOptions{}.with_quality(quality);
  fields::scale(o, voxel_size);
  return o;
}

RegistrationOptions RegistrationOptions::loopsmart() {
  return loopsmart(PrepareOptions{}.voxel_size);
}

RegistrationOptions RegistrationOptions::loopsmart(float voxel_size) {
  RegistrationOptions o = from_voxel_size(voxel_size);
  o.prepare.wide_feature_radius = 0;
  o.prepare.depth_maps = 0;
  o.prepare.surface_side_distance = 0;
  o.method = RegistrationMethod::quadruples;
  o.refine.max_iterations = 0;
  return o;
}

}  // namespace gpureg
