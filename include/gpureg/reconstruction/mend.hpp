// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <vector>

#include "gpureg/reconstruction/audit.hpp"

namespace gpureg::reconstruction {

/// A map that was put together again where its audit contradicted it.
struct MendedMap {
  /// In the frames of the islands given; not finite: what is right could not be found.
  std::vector<UnalignedIsometry3d> world_from_scan;
  std::vector<std::uint32_t> moved;     ///< scans that got another pose, ascending
  std::vector<std::uint32_t> left_out;  ///< scans that have none any more, ascending
  std::size_t registered = 0;           ///< pairs that were aligned
  Audit audit;                          ///< of the mended map
};

/// Takes each contradicted island apart at its contradicted connections, aligns scans across them,
/// and puts the parts together as reconstruct() does; parts that too few sure pairs connect are
/// joined if an audit of the joined parts confirms it. If a few scans take part in all
/// contradictions, they alone are taken out. Within the parts, poses stay as they are, but for what
/// the pose graph spreads. The part with the most scans keeps its place. What an audit of the
/// mended map still contradicts is left out, so that nothing of the map is contradicted. Other
/// islands stay as they are, and islands are not joined.
/// @param found what audit() says about this map.
/// @throws InvalidArgument as audit() and align_batch(); Cancelled.
MendedMap mend(const Context& context, const std::vector<PreparedCloud>& clouds,
               const Reconstruction& map, const Audit& found,
               const RegistrationOptions& registration = {}, const AuditOptions& options = {});

/// The same for poses of one frame.
MendedMap mend(const Context& context, const std::vector<PreparedCloud>& clouds,
               const std::vector<UnalignedIsometry3d>& world_from_scan, const Audit& found,
               const RegistrationOptions& registration = {}, const AuditOptions& options = {});

}  // namespace gpureg::reconstruction
