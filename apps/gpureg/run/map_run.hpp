// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "gpureg/context.hpp"
#include "gpureg/options.hpp"
#include "gpureg/reconstruction.hpp"
#include "gpureg/reconstruction/audit.hpp"
#include "inputs/scene.hpp"
#include "records/pair_store.hpp"

namespace gpureg::cli {

/// Everything that `gpureg reconstruct` knows at its end, for the files that it writes.
struct MapRun {
  ScanInput input;
  std::string output;
  RegistrationOptions options;
  PreparedFolder scene;  ///< without prepared clouds where the pairs come from a file
  PairStore pairs;
  reconstruction::Reconstruction map;
  std::optional<reconstruction::Audit> audit;  ///< none: --no-audit
  bool places_look_alike = false;              ///< AuditedReconstruction
  std::optional<reconstruction::RefineReport> refined;
  bool aligned_here = false;  ///< the pairs were aligned by this run
  std::size_t pairs_in_this_run = 0;
  std::size_t map_points = 0;
  struct {
    double prepare = 0, prune = 0, align = 0, graph = 0, surfaces = 0, refine = 0, write = 0;
  } seconds;

  std::string file(const std::string& name) const;  ///< path in the output folder
  std::size_t accepted_edges() const;
};

}  // namespace gpureg::cli
