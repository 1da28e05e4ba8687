// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "fields/options.hpp"
#include "gpureg/localization/find.hpp"

namespace gpureg::fields {

template <>
struct Fields<localization::FindOptions> {
  static constexpr const char* kName = "FindOptions";
  static constexpr const char* kGroup = "";
  static constexpr const char* kSentence = "How the instances of a part are found in a scene.";

  // clang-format off: a field is a line.
  template <typename V>
  static void visit(V&& v) {
    using O = localization::FindOptions;
    v(&O::voxel_size, {"voxel_size", kLengthOrZero, "Of the search; 0: a twentieth of the part."});
    v(&O::quality, {"quality", from(0, kHighestQuality), "0 is the fastest, 10 finds the most."});
    v(&O::seed, {"seed", "Same seed, same bits."});
    v(&O::min_confidence, {"min_confidence", kProbability, "Confidence from which a pose is an instance."});
  }
  // clang-format on
};

template <>
struct Fields<localization::PartEvidence> {
  static constexpr const char* kName = "PartEvidence";
  static constexpr const char* kSentence = "Evidence for and against a pose of a part in a scene.";

  // clang-format off: a field is a line.
  template <typename V>
  static void visit(V&& v) {
    using E = localization::PartEvidence;
    v(&E::occluded, {"occluded", "Of the surface in view, the share behind something of the scene."});
    v(&E::supported, {"supported", "Of the surface in view and not occluded, the share on a surface of the scene with a similar normal."});
    v(&E::violated, {"violated", "The share that the sensor looked through."});
    v(&E::contour, {"contour", "Of the outline around the supported surface, the share behind which the scene recedes."});
    v(&E::contour_length, {"contour_length", "Of the outline that tells, over the diameter of the part."});
    v(&E::area, {"area", "Supported, seen from the sensor, over the squared diameter."});
    v(&E::cell, {"cell", "Edge of a pixel of the depth image of the part, over the diameter; without a viewpoint, the spacing of its points."});
    v(&E::residual, {"residual", "RMS distance of the supported surface, over the voxel of the evidence."});
    v(&E::weakest, {"weakest", "Smallest eigenvalue of the point-to-plane information per point, rotations in units of the part's radius."});
    v(&E::third_weakest, {"third_weakest", "The third smallest one."});
    v(&E::votes, {"votes", "Alignments that ended at this pose."});
    v(&E::rival, {"rival", "Support of the best other pose of this surface over that of this one; 0: none."});
    v(&E::viewpoint_known, {"viewpoint_known", "It is known from where the scene was seen."});
  }
  // clang-format on
};

}  // namespace gpureg::fields
