// SPDX-License-Identifier: BSD-3-Clause
#include "settings/resolve.hpp"

#include <sstream>

#include "common/shown.hpp"
#include "fields/assign.hpp"
#include "fields/validate.hpp"
#include "settings/fields.hpp"

namespace gpureg {
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

PrepareSettings lengths_of(const PrepareOptions& options, float v) {
  PrepareSettings out;
  out.voxel_size = options.downsample ? v : 0;
  out.unit = v;
  out.normal_radius = options.normal_radius * v;
  out.feature_radius = options.feature_radius * v;
  out.wide_feature_radius = options.wide_feature_radius * v;
  out.max_correspondence_distance = options.max_correspondence_distance * v;
  out.depth_maps = options.depth_maps;
  out.surface_side_distance = options.surface_side_distance * v;
  out.keep_range_limits = options.keep_range_limits;
  return out;
}

RegistrationSettings settings_of(const RegistrationOptions& options) {
  const float v = options.voxel_size;
  RegistrationSettings out = RegistrationSettings{}.with_quality(options.quality);
  out.seed = options.seed;
  out.min_confidence = options.min_confidence;
  out.method = options.method;
  out.accept_symmetry = options.accept_symmetry;
  out.calibration = options.calibration;
  out.prepare = lengths_of(options.prepare, v);
  out.compatibility.tolerance = v;
  out.compatibility.consensus_distance = 2 * v;
  out.compatibility.seed_separation = 2 * v;
  out.quadruples.count = options.quadruples;
  out.quadruples.min_inlier_ratio = static_cast<float>(options.min_confidence);
  out.refine.max_iterations = options.refine_iterations;
  out.refine.kernel_width = v / 2;
  out.evidence.mode_distance = 6 * v;
  out.evidence.degeneracy_search_distance = 8 * v;
  out.evidence.free_space_margin = v / 5 * 12;  // exactly 0.12 for voxels of 0.05
  out.evidence.min_range = 6 * v;
  std::istringstream assignments(options.tune);
  for (std::string assignment; assignments >> assignment;) try {
      fields::assign(out, assignment);
    } catch (const InvalidArgument& error) {
      throw InvalidArgument("tune: " + std::string(error.what()));
    }
  return out;
}

/// Calls validate() of settings whose options are in their ranges.
template <typename Settings>
const Settings& checked(const Settings& settings, float voxel_size, bool tuned) {
  try {
    settings.validate();
  } catch (const InvalidArgument& error) {
    if (tuned) throw InvalidArgument("tune: " + std::string(error.what()));
    throw InvalidArgument("voxel_size is " + shown(voxel_size) +
                          ", from which follows: " + error.what());
  }
  return settings;
}

void check_voxel_size(float voxel_size) {
  require(fields::kLength.contains(static_cast<double>(voxel_size)), "voxel_size", voxel_size,
          fields::kLength.expected);
}

}  // namespace

void PrepareSettings::validate() const {
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

void QuadrupleSettings::validate() const { fields::validate(*this); }
void CompatibilitySettings::validate() const { fields::validate(*this); }
void EvidenceSettings::validate() const { fields::validate(*this); }
void RefineSettings::validate() const { fields::validate(*this); }
void RegistrationSettings::validate() const { fields::validate(*this); }

RegistrationSettings RegistrationSettings::with_quality(std::uint32_t quality) const {
  require(quality <= kHighestQuality, "quality", quality, "0 to 10");
  RegistrationSettings o = *this;
  o.compatibility.max_matches = kEfforts[quality].matches;
  o.compatibility.seeds = kEfforts[quality].seeds;
  o.compatibility.triangles = kEfforts[quality].triangles;
  o.evidence.modes = kEfforts[quality].modes;
  return o;
}

RegistrationSettings resolve(const RegistrationOptions& options) {
  fields::validate(options);
  return checked(settings_of(options), options.voxel_size, !options.tune.empty());
}

PrepareSettings resolve(const PrepareOptions& options, float voxel_size) {
  check_voxel_size(voxel_size);
  options.validate();
  return checked(lengths_of(options, voxel_size), voxel_size, false);
}

}  // namespace gpureg
