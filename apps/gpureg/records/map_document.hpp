// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>

#include "gpureg/context.hpp"
#include "json/json_fwd.hpp"
#include "records/map_run.hpp"

namespace gpureg::cli {

/// pairs.json without its pairs: what `gpureg report` and `--results` read.
Json pairs_head(const MapRun& run, const reconstruction::MapOfSet& made, const Context& context);

/// reconstruction.json.
Json map_document(const MapRun& run, const Context& context);

/// The summary for people, a line each.
std::string map_summary(const MapRun& run, const Context& context);

}  // namespace gpureg::cli
