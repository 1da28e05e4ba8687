// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>
#include <vector>

#include "gpureg/context.hpp"
#include "gpureg/reconstruction/audit.hpp"
#include "inputs/scene.hpp"
#include "json/json_fwd.hpp"

namespace gpureg::cli {

/// Everything that `gpureg audit` knows at its end.
struct AuditRun {
  ScanInput input;
  std::string poses_file;
  RegistrationOptions options;
  PreparedFolder scene;
  reconstruction::Reconstruction map;  ///< poses and islands
  std::vector<int> missing;            ///< numbers of fragments without a pose
  reconstruction::Audit audit;
  double seconds = 0;
};

/// The scans of an island as people write them.
std::string island_scans(const AuditRun& run, std::size_t island);

/// Where a connection is broken, and which scans say so, in one sentence.
std::string describe(const AuditRun& run, const reconstruction::AuditedConnection& connection);

/// What --json writes.
Json audit_document(const AuditRun& run, const Context& context);

/// The audit as it enters other documents: pairs that contradict, and all connections.
Json audit_json(const reconstruction::Audit& audit, const std::vector<io::ScanFile>& scans);

}  // namespace gpureg::cli
