// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "gpureg/reconstruction.hpp"

namespace gpureg::reconstruction {

/// Information of a registered pose in the convention of pose_graph::Edge: EdgeNoiseOptions at the
/// centre of the overlap, less along the direction that the geometry holds weakly.
/// @param mode pose and evidence; without eigenvalues the noise is isotropic.
/// @param source_centre of the overlap, in the source's frame.
/// @param unit Options::information_unit.
/// @param flat RegistrationResult::flat: only the motions in the plane tell typical ones from weak
/// ones.
pose_graph::UnalignedMatrix6d edge_information(const RegistrationMode& mode,
                                               const Eigen::Vector3d& source_centre,
                                               const EdgeNoiseOptions& noise, double unit,
                                               bool flat = false);

/// Centre of the overlap in the source's frame; the origin where it is not known.
Eigen::Vector3d overlap_centre(const RegistrationResult& result);

}  // namespace gpureg::reconstruction
