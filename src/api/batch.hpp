// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <vector>

#include "api/variants.hpp"
#include "pipeline/engine.hpp"

namespace gpureg {

/// One call of align_batch() with checked arguments. The variants go through the engine in chunks.
/// Where the engine leaves the host idle, the host concludes a chunk (evidence to results) while
/// the engine aligns the next one; two chunks at most are in memory. References must outlive it.
class Batch {
 public:
  /// @param priors of the pairs, or none.
  Batch(Engine& engine, const std::vector<PairVariant>& variants,
        const std::vector<RegistrationPrior>& priors, const RegistrationOptions& options,
        const BatchCallbacks& callbacks, std::size_t pairs);

  /// The results of all pairs. Rethrows what the engine or a callback throws, the error of the
  /// earlier chunk first.
  std::vector<RegistrationResult> run();

 private:
  struct Chunk {
    std::size_t begin = 0, end = 0;  ///< variants
    std::vector<PairInput> inputs;
    std::vector<PairOutcome> outcomes;
    std::size_t size() const { return end - begin; }
  };
  Chunk chunk_of(std::size_t begin, std::size_t end) const;
  void align(Chunk& chunk) const;
  /// Results of an aligned chunk, to the callback too.
  void conclude(const Chunk& chunk);
  RegistrationResult result_of(const Chunk& chunk, std::size_t variant) const;

  Engine& engine_;
  const std::vector<PairVariant>& variants_;
  const std::vector<RegistrationPrior>& priors_;
  const RegistrationOptions& options_;
  const BatchCallbacks& callbacks_;
  std::vector<RegistrationResult> results_;
};

}  // namespace gpureg
