// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "gpureg/registration.hpp"

/// Where in a scan the instances of a known part are: bin picking, templates, furniture in rooms.
namespace gpureg::localization {

/// Options of find().
struct FindOptions {
  /// Edge of the voxels of the search, in the unit of the points; 0: a twentieth of the part's
  /// diameter, and not below the spacing of the scene. Evidence is taken in a quarter of it.
  float voxel_size = 0;
  /// Of the alignments: 0 is the fastest, 10 finds the most.
  std::uint32_t quality = kDefaultQuality;
  std::uint64_t seed = 1;  ///< same seed, same bits
  /// Confidence from which a pose counts as an instance.
  double min_confidence = 0.5;

  /// @throws InvalidArgument naming field and value.
  void validate() const;
};

/// Evidence for and against a pose of a part. In view: the surface of the part that the scene's
/// sensor would see if nothing stood in front of it, by the depth image of the part at the pose.
/// Without a known viewpoint: its surface seen from the direction that suits the scene best; then
/// nothing is hidden, violated or a contour.
struct PartEvidence {
  /// Of the surface in view, the share behind something of the scene.
  double occluded = 0;
  /// Of the surface in view and not occluded: share on a surface of the scene with a similar normal
  double supported = 0;
  double violated = 0;  ///< share that the sensor looked through
  /// Of the outline around the supported surface, the share behind which the scene recedes. A
  /// surface that goes on beyond the outline is not that of the part.
  double contour = 0;
  double contour_length = 0;  ///< of the outline that tells, over the diameter of the part
  double area = 0;            ///< supported, seen from the sensor, over the squared diameter
  double cell = 0;            ///< edge of a pixel of the depth image, over the diameter
  double residual = 1;        ///< RMS distance of the supported surface, over the voxel of evidence
  /// Smallest eigenvalue, and third smallest, of the point-to-plane information of the supported
  /// surface per point, with rotations about its middle in units of the part's radius.
  double weakest = 0, third_weakest = 0;
  std::uint32_t votes = 0;  ///< alignments of parts of the scene that ended here
  /// Support of the best other pose for the same surface that no symmetry of the part explains,
  /// over that of this one; 0: none.
  double rival = 0;
  bool viewpoint_known = false;
};

/// An instance of a part.
struct FoundPart {
  UnalignedIsometry3d scene_from_part = no_pose();
  double confidence = 0;  ///< probability that the pose is correct, up to symmetry
  PartEvidence evidence;
  /// Other poses that a symmetry of the part makes equal to this one, as far as the search met
  /// them.
  std::uint32_t equivalent_poses = 0;
};

enum class FindStatus : std::uint8_t {
  found,                   ///< one instance or more
  not_found,               ///< no pose reaches min_confidence
  too_few_part_points,     ///< the part has next to no surface
  too_few_scene_points,    ///< the scene is empty, or next to
  scene_smaller_than_part  ///< the scene has no room for the part
};

const char* to_string(FindStatus status);

struct FindResult {
  FindStatus status = FindStatus::not_found;
  /// Distinct instances, the most confident first: no two share much of the scene's surface.
  std::vector<FoundPart> instances;
  /// The same below min_confidence, as far as they deserve a look.
  std::vector<FoundPart> doubtful;
  float voxel_size = 0;  ///< of the search, that was used
  /// Of the evidence: a quarter of it, or more where the points of the part or of the scene are far
  /// apart, and half of it where the viewpoint of the scene is not known. 0: none was taken.
  float evidence_voxel_size = 0;
  double diameter = 0;                            ///< of the part: diagonal of its box
  double scene_extent = 0;                        ///< diagonal of the box of the scene
  std::size_t part_points = 0, scene_points = 0;  ///< prepared
  std::size_t neighborhoods = 0;  ///< pieces of the scene that the part was aligned with
};

/// @return one English sentence without full stop for messages.
std::string explain(const FindResult& result);

/// Finds the instances of a part in a scene. The part is aligned with overlapping neighbourhoods of
/// the scene about as large as itself; distinct poses are verified by the depth image that the part
/// would have, refined, and accepted in the order of their confidence as long as they do not share
/// the surface of a better one. Deterministic, the same bits on every backend and for any number of
/// threads. Thread-safe.
/// @param part host memory; a model (PointCloudView::model, as of io::sample_mesh) or a scan.
/// @param scene host memory, the unit of the part; viewpoints as for prepare().
/// @throws InvalidArgument as prepare(), for a voxel size that does not suit the part, for a part
///   whose points are far apart, and for a scene so large that its unit must be another one.
/// @throws DeviceError if the device fails.
FindResult find(const Context& context, const PointCloudView& part, const PointCloudView& scene,
                const FindOptions& options = {});

}  // namespace gpureg::localization
