// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <vector>

#include "gpureg/reconstruction.hpp"

namespace gpureg::reconstruction {

/// Odometry with the information that drift leaves where none is given.
/// @throws InvalidArgument naming the entry: an index out of range, a scan with itself, a pose that
///   is not rigid, a matrix that is no information, a confidence out of range.
std::vector<Odometry> checked_odometry(std::size_t scans, std::vector<Odometry> odometry,
                                       const pose_graph::DriftOptions& drift);

/// Nodes are indices of scans.
pose_graph::Edge edge_of(const Odometry& odometry);

/// A relative pose with isotropic noise at the source: standard deviations in metres and radians.
Odometry odometry_of(std::uint32_t source, std::uint32_t target,
                     const UnalignedIsometry3d& target_from_source, double shift, double turn);

/// Each scan of a part with the one before it, as odometry_of().
/// @param parts of each scan; 0xffffffff: of none.
std::vector<Odometry> chains_of(const std::vector<UnalignedIsometry3d>& poses,
                                const std::vector<std::uint32_t>& parts, double shift, double turn);

}  // namespace gpureg::reconstruction
