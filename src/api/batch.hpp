// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <vector>

#include "api/aligned_pair.hpp"
#include "pipeline/engine.hpp"

namespace gpureg {

/// One call of align_batch() with checked arguments. The pairs go through the engine in chunks.
/// Where the engine leaves the host idle, the host concludes a chunk (evidence to results) while
/// the engine aligns the next one; two chunks at most are in memory. References must outlive it.
class Batch {
 public:
  /// @param variants of the pairs 0 to pairs - 1, in that order.
  /// @param priors of the pairs, or none.
  Batch(Engine& engine, const std::vector<PairVariant>& variants,
        const std::vector<RegistrationPrior>& priors, const RegistrationSettings& options,
        const BatchCallbacks& callbacks, std::size_t pairs);

  /// The results of all pairs. Rethrows what the engine or a callback throws, the error of the
  /// earlier chunk first.
  std::vector<RegistrationResult> run();

 private:
  struct Chunk {
    std::size_t first = 0;  ///< of its variants, which are all those of its pairs
    std::vector<PairInput> inputs;
    std::vector<PairOutcome> outcomes;
    std::vector<std::vector<std::uint32_t>> given;  ///< indices of correspondences, for inputs
    std::size_t size() const { return inputs.size(); }
  };
  /// The next chunk, none behind the last one or if the caller has stopped the batch.
  Chunk next_chunk();
  bool starts_pair(std::size_t variant) const {
    return variant == 0 || variants_[variant].pair != variants_[variant - 1].pair;
  }
  void align(Chunk& chunk) const;
  /// Results of an aligned chunk, to the callback too. Its outcomes are used up.
  void conclude(Chunk& chunk);

  Engine& engine_;
  const std::vector<PairVariant>& variants_;
  const std::vector<RegistrationPrior>& priors_;
  const RegistrationSettings& options_;
  const BatchCallbacks& callbacks_;
  std::size_t next_ = 0;  ///< variant that the next chunk starts with
  std::vector<RegistrationResult> results_;
};

}  // namespace gpureg
