// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <functional>
#include <vector>

#include "gpureg/result.hpp"

namespace gpureg {

/// The mode that most speaks for, and the logarithm of its odds, of its own evidence alone.
struct Likeliest {
  std::size_t mode;
  double log_odds;
};

/// evidence: of the modes of one pair, not empty.
Likeliest likeliest_of(const std::vector<PoseEvidence>& evidence);

/// How many points touch under a pose, and of how many: the smaller number of both clouds.
struct Touching {
  std::uint32_t count, of;
};

/// Orders the modes of one pair by how much speaks for them, drops those that are the same as a
/// better one, and fills in their confidence from the evidence of all of them. refined: as many as
/// were refined at most, EvidenceOptions::modes; how many of them ended in places of their own
/// tells how little the clouds say.
void set_confidences(
    std::vector<RegistrationMode>& modes, std::uint32_t refined,
    const std::function<Touching(const RegistrationMode&)>& touching,
    const std::function<bool(const RegistrationMode&, const RegistrationMode&)>& same);

}  // namespace gpureg
