// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "gpureg/evidence.hpp"
#include "gpureg/localization/find.hpp"
#include "gpureg/options.hpp"
#include "gpureg/statistics.hpp"
#include "json/json_fwd.hpp"

/// Structs whose fields the library describes, as JSON: each field under its name in the API, the
/// source's and the target's side of one as a pair. Floats become their shortest decimal: 0.05, not
/// 0.05000000074.
namespace gpureg::cli {

Json to_json(const RegistrationOptions& options);
Json to_json(const RegistrationStatistics& statistics);
Json to_json(const StageTimings& timings);       ///< milliseconds per stage, and their total
Json to_json(const PrepareStatistics& prepare);  ///< counts, and "ms" per stage
Json to_json(const PoseEvidence& evidence);
Json to_json(const localization::PartEvidence& evidence);

/// Reads the fields that are there; the others keep their values.
/// @throws InvalidArgument naming a field whose value does not fit.
void read_json(const Json& json, PoseEvidence& evidence);
void read_json(const Json& json, RegistrationStatistics& statistics);
void read_json(const Json& json, StageTimings& timings);

}  // namespace gpureg::cli
