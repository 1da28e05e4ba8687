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

/// Orders the modes of one pair by how much speaks for them, drops those that are the same as a better one, and fills in their confidence
/// from the evidence of all of them. refined: as many as were refined at most, EvidenceOptions::modes; how many of them ended in places of
/// their own tells how little the clouds say. touching(mode): how many points touch, the smaller number of both sides.
void set_confidences(std::vector<RegistrationMode>& modes, std::uint32_t refined, const std::function<std::uint32_t(const RegistrationMode&)>& touching,
                     const std::function<bool(const RegistrationMode&, const RegistrationMode&)>& same);

}  // namespace gpureg
