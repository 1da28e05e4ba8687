// SPDX-License-Identifier: BSD-3-Clause
#include "gpureg/options.hpp"

#include "common/limits.hpp"
#include "common/validate.hpp"
#include "math/exponential.hpp"

namespace gpureg {

namespace {
bool length(float v) { return positive(v) && v <= limits::kMaxLength && v >= limits::kMinLength; }
constexpr const char* kLength = "a length in [1e-6, 1e6]";
}  // namespace

const char* to_string(RegistrationMethod method) {
  return method == RegistrationMethod::quadruples ? "quadruples" : "compatibility";
}

void PrepareOptions::validate() const {
  require(voxel_size == 0.0f || length(voxel_size), "prepare.voxel_size", voxel_size,
          "0 or a length in [1e-6, 1e6]");
  require(length(normal_radius), "prepare.normal_radius", normal_radius, kLength);
  require(length(feature_radius), "prepare.feature_radius", feature_radius, kLength);
  require(length(max_correspondence_distance), "prepare.max_correspondence_distance",
          max_correspondence_distance, kLength);
  require(wide_feature_radius == 0.0f || length(wide_feature_radius), "prepare.wide_feature_radius",
          wide_feature_radius, "0 or a length in [1e-6, 1e6]");
  require(wide_feature_radius <= limits::kMaxRadiusRatio * feature_radius,
          "prepare.wide_feature_radius", wide_feature_radius,
          "at most 4 times prepare.feature_radius");
  require(depth_maps <= limits::kMaxDepthMaps, "prepare.depth_maps", depth_maps, "at most 64");
  require(surface_side_distance == 0.0f || length(surface_side_distance),
          "prepare.surface_side_distance", surface_side_distance, "0 or a length in [1e-6, 1e6]");
  require(voxel_size == 0.0f || feature_radius <= limits::kMaxFeatureRadiusInVoxels * voxel_size,
          "prepare.feature_radius", feature_radius, "at most 100 times prepare.voxel_size");
  require(normal_radius <= limits::kMaxRadiusRatio * feature_radius, "prepare.normal_radius",
          normal_radius, "at most 4 times prepare.feature_radius");
  require(voxel_size == 0.0f ||
              max_correspondence_distance <= limits::kMaxCorrespondenceInVoxels * voxel_size,
          "prepare.max_correspondence_distance", max_correspondence_distance,
          "at most 20 times prepare.voxel_size");
}

namespace {
void require_angle(float degrees, const char* name) {
  require(std::isfinite(degrees) && degrees > 0 && degrees <= 180, name, degrees,
          "degrees in (0, 180]");
}
void require_range(std::uint32_t value, std::uint32_t low, std::uint32_t high, const char* name) {
  const std::string expected = std::to_string(low) + " to " + std::to_string(high);
  require(value >= low && value <= high, name, value, expected.c_str());
}
}  // namespace

void QuadrupleOptions::validate() const {
  require(count >= 1 && count <= limits::kMaxQuadruples, "quadruples.count", count, "1 to 2^30");
  require_range(neighbors, 1, limits::kMaxNeighbors, "quadruples.neighbors");
  require(max_survivors >= 1 && max_survivors <= limits::kMaxSurvivors, "quadruples.max_survivors",
          max_survivors, "1 to 2^22");
  require(std::isfinite(edge_similarity) && edge_similarity > 0 && edge_similarity <= 1,
          "quadruples.edge_similarity", edge_similarity, "a ratio in (0, 1]");
  require_angle(max_normal_angle, "quadruples.max_normal_angle");
  require_angle(max_verification_normal_angle, "quadruples.max_verification_normal_angle");
  require(std::isfinite(min_inlier_ratio) && min_inlier_ratio >= 0 && min_inlier_ratio <= 1,
          "quadruples.min_inlier_ratio", min_inlier_ratio, "a ratio in [0, 1]");
}

void CompatibilityOptions::validate() const {
  require_range(max_matches, limits::kMinMatches, limits::kMaxMatches, "compatibility.max_matches");
  require_range(seeds, 1, limits::kMaxSeeds, "compatibility.seeds");
  require_range(max_members, limits::kMinMembers, limits::kMaxMembers, "compatibility.max_members");
  require_range(triangles, 1, limits::kMaxTriangles, "compatibility.triangles");
  require_range(refits, 1, limits::kMaxRefits, "compatibility.refits");
  require(std::isfinite(max_turn) && max_turn > 0 && max_turn <= 2, "compatibility.max_turn",
          max_turn, "a difference of cosines in (0, 2]");
  require(length(tolerance), "compatibility.tolerance", tolerance, kLength);
  require(length(consensus_distance), "compatibility.consensus_distance", consensus_distance,
          kLength);
  require(length(seed_separation), "compatibility.seed_separation", seed_separation, kLength);
}

void EvidenceOptions::validate() const {
  require_range(sample, limits::kMinSample, limits::kMaxSample, "evidence.sample");
  require_range(modes, 1, limits::kMaxModes, "evidence.modes");
  require_angle(max_normal_angle, "evidence.max_normal_angle");
  require_angle(mode_angle, "evidence.mode_angle");
  require(length(mode_distance), "evidence.mode_distance", mode_distance, kLength);
  require(degeneracy_search_distance == 0.0f || length(degeneracy_search_distance),
          "evidence.degeneracy_search_distance", degeneracy_search_distance,
          "0 or a length in [1e-6, 1e6]");
  require(length(free_space_margin), "evidence.free_space_margin", free_space_margin, kLength);
  require(length(min_range), "evidence.min_range", min_range, kLength);
}

void RefineOptions::validate() const {
  require(max_iterations <= limits::kMaxIterations, "refine.max_iterations", max_iterations,
          "at most 1000");
  require(length(kernel_width), "refine.kernel_width", kernel_width, kLength);
}

double ConfidenceCalibration::operator()(double confidence) const {
  if (is_identity() || confidence <= 0 || confidence >= 1) return confidence;
  const double log_odds = portable::log(confidence) - portable::log1p(-confidence);
  return portable::logistic(offset + slope * log_odds);
}

void ConfidenceCalibration::validate() const {
  require(std::isfinite(slope) && slope > 0, "calibration.slope", slope, "a number > 0");
  require(std::isfinite(offset), "calibration.offset", offset, "a finite number");
}

namespace {

/// Numbers of candidates by quality. More seeds find more of the difficult pairs, and more modes
/// keep their poses. Matches and evidence do not depend on the quality, so a confidence means the
/// same at every quality.
struct Effort {
  std::uint32_t seeds, triangles, modes;
};
constexpr Effort kEfforts[kHighestQuality + 1] = {{64, 32, 8},     {128, 32, 12},   {256, 48, 16},
                                                  {384, 64, 16},   {512, 64, 24},   {1024, 64, 24},
                                                  {1536, 96, 32},  {2048, 128, 48}, {3072, 192, 48},
                                                  {4096, 256, 64}, {8192, 384, 64}};

}  // namespace

RegistrationOptions RegistrationOptions::with_quality(std::uint32_t quality) const {
  require_range(quality, 0, kHighestQuality, "quality");
  RegistrationOptions o = *this;
  o.compatibility.seeds = kEfforts[quality].seeds;
  o.compatibility.triangles = kEfforts[quality].triangles;
  o.evidence.modes = kEfforts[quality].modes;
  return o;
}

RegistrationOptions RegistrationOptions::from_voxel_size(float voxel_size, std::uint32_t quality) {
  require(length(voxel_size), "voxel_size", voxel_size, kLength);
  RegistrationOptions o = RegistrationOptions{}.with_quality(quality);
  o.prepare.voxel_size = voxel_size;
  o.prepare.normal_radius = 2.0f * voxel_size;
  o.prepare.feature_radius = 5.0f * voxel_size;
  o.prepare.max_correspondence_distance = 1.5f * voxel_size;
  o.refine.kernel_width = 0.5f * voxel_size;
  o.prepare.wide_feature_radius = 8.0f * voxel_size;
  o.prepare.surface_side_distance = 10.0f * voxel_size;
  o.compatibility.tolerance = voxel_size;
  o.compatibility.consensus_distance = 2.0f * voxel_size;
  o.compatibility.seed_separation = 2.0f * voxel_size;
  o.evidence.mode_distance = 6.0f * voxel_size;
  o.evidence.degeneracy_search_distance = 8.0f * voxel_size;
  // 2.4 v; this order of operations gives exactly the default at 0.05.
  o.evidence.free_space_margin = voxel_size / 5.0f * 12.0f;
  o.evidence.min_range = 6.0f * voxel_size;
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

void RegistrationOptions::validate() const {
  prepare.validate();
  compatibility.validate();
  quadruples.validate();
  refine.validate();
  evidence.validate();
  require(std::isfinite(min_confidence) && min_confidence >= 0 && min_confidence <= 1,
          "min_confidence", min_confidence, "a probability in [0, 1]");
  calibration.validate();
}

}  // namespace gpureg
