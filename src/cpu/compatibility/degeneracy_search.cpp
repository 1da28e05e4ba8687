// SPDX-License-Identifier: BSD-3-Clause
#include "confidence/degeneracy_search.hpp"

#include "cpu/common/stages.hpp"

namespace gpureg::cpu {

std::vector<PosesOfPair> search_degeneracies(Exec& exec, Span<const PairInput> inputs,
                                             Span<const PairOutcome> outcomes,
                                             const RegistrationOptions& options) {
  return confidence::search_degeneracies(inputs, outcomes, options, exec.threads());
}

}  // namespace gpureg::cpu
