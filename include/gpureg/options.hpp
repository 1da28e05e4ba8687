// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <string>

namespace gpureg {

/// How candidate poses are found.
enum class RegistrationMethod : std::uint8_t {
  /// Second-order compatibility of matches (SC2-PCR, Chen et al. 2022); distinct poses are refined
  /// and verified by evidence. The default.
  compatibility,
  /// Uniform quadruples of matches, the winner by its inliers (LoopSmart, Algorithm 1).
  quadruples
};

const char* to_string(RegistrationMethod method);

/// How a raw cloud becomes a PreparedCloud. Lengths are in voxels: multiples of
/// RegistrationOptions::voxel_size.
struct PrepareOptions {
  /// One centroid per voxel; false: keep the points as they are.
  bool downsample = true;
  /// Neighbourhood of the normal's PCA (paper: 2). The wide FPFH is computed from normals of a
  /// radius that is larger by wide_feature_radius / feature_radius, at most 4 feature_radius.
  float normal_radius = 2;
  float feature_radius = 5;  ///< neighbourhood of FPFH, also of its SPFH (paper: 5)
  /// Neighbourhood of a second FPFH, matched beside the first (only if the features are FPFH);
  /// 0: none (paper: none). Wide features find matches on floors and walls, where small
  /// neighbourhoods look alike.
  float wide_feature_radius = 8;
  /// Largest distance of an inlier and of a correspondence of the refinement (paper: 1.5). It sets
  /// the cell size of the closest-point grid, so clouds are prepared with it. An alignment may use
  /// a smaller one than its clouds were prepared with, never a larger one.
  float max_correspondence_distance = 1.5f;
  /// Number of viewpoints that get a depth map for free-space tests, evenly chosen among the
  /// cloud's; 0: no maps, and given normals are never turned (PointCloudView::viewpoints). A map
  /// takes 110 KB.
  std::uint32_t depth_maps = 10;
  /// Range in front of and behind its surfaces within which a cloud tells the two sides apart, for
  /// the evidence; 0: not at all (paper: 0). Takes half a byte for each cell of a tenth of it in
  /// the cloud's box; a box of more than 2^26 cells gets none.
  float surface_side_distance = 10;
  /// Keep points at the smallest and the largest range of the sensor: a tank scanned from its
  /// centre has its wall there. Otherwise they are left out, because they are fixed to the sensor
  /// and support no other pose than that at which it did not move
  /// (gpureg/preparation/sensor_fixed.hpp).
  bool keep_range_limits = false;

  /// @throws InvalidArgument naming field and value.
  void validate() const;
};

/// Confidence of another sensor from the confidence that was fitted here:
/// logit(calibrated) = offset + slope * logit(confidence). calibrate() makes it
/// (gpureg/calibration.hpp); the default is the identity.
struct ConfidenceCalibration {
  double slope = 1;  ///< > 0
  double offset = 0;

  bool is_identity() const { return slope == 1 && offset == 0; }

  /// The calibrated probability. 0 and 1 stay what they are, and so does every confidence under the
  /// identity, bit for bit.
  double operator()(double confidence) const;

  /// @throws InvalidArgument naming field and value.
  void validate() const;
};

/// The range of `quality`: 0 is the fastest, 10 finds the most.
inline constexpr std::uint32_t kDefaultQuality = 5, kHighestQuality = 10;

/// All options of one registration. An aggregate with in-class defaults: RegistrationOptions{0.1f}
/// is for voxels of 10 cm, RegistrationOptions{0.1f, 8} also finds more.
struct RegistrationOptions {
  /// Edge of the downsampling voxel, in the unit of the points (paper: 0.05). Every other length
  /// follows from it.
  float voxel_size = 0.05f;
  /// Number of candidate poses, 0 to kHighestQuality: time against recall
  /// (RegistrationMethod::compatibility).
  std::uint32_t quality = kDefaultQuality;
  std::uint64_t seed = 1;  ///< same seed, same bits: on any backend, thread count and batch split
  /// Confidence below which no alignment is reported, [0, 1]. With RegistrationMethod::quadruples
  /// it is the verified inlier ratio; loopsmart() sets 0.3 (CZK: 0.33).
  double min_confidence = 0.5;
  /// Report one of several poses that a symmetry of the larger cloud makes equivalent if their
  /// common confidence reaches min_confidence: status aligned_up_to_symmetry. Otherwise such a pair
  /// is not aligned, for the reason symmetric (RegistrationMethod::compatibility).
  bool accept_symmetry = false;
  /// Applied to every confidence (RegistrationMethod::compatibility).
  ConfidenceCalibration calibration = {};
  RegistrationMethod method = RegistrationMethod::compatibility;
  /// Quadruples drawn per pair, 1..2^30 (paper: 4,000,000; RegistrationMethod::quadruples).
  std::uint32_t quadruples = 4'000'000;
  std::uint32_t refine_iterations = 16;  ///< of ICP at most; 0 switches it off (paper: off)
  PrepareOptions prepare = {};
  /// Internal constants by their names, for experiments: "evidence.sample=1024 refine.kernel_width=
  /// 0.05". src/settings/settings.hpp has them, lengths in the unit of the points. They may change
  /// with any version.
  std::string tune = {};

  /// The paper's algorithm with the paper's numbers, in voxels (Zhang and Chen, LoopSmart, section
  /// III): 4,000,000 quadruples, no refinement, no second features.
  static RegistrationOptions loopsmart(float voxel_size = 0.05f);

  /// @throws InvalidArgument naming the first field that is out of range, and its value.
  void validate() const;
};

}  // namespace gpureg
