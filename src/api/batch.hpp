// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <optional>
#include <vector>

#include "api/variants.hpp"
#include "pipeline/engine.hpp"

namespace gpureg {

/// Options of the first pass of these options, with few candidates; none: every pair is aligned in
/// full. The confidence of the first pass decides most pairs (compatibility.first_pass_reject and
/// first_pass_accept); the others are aligned in full.
std::optional<RegistrationOptions> first_pass_of(const RegistrationOptions& options);

/// One call of align_batch() with checked arguments. The pairs go through the engine in chunks.
/// Where the engine leaves the host idle, the host concludes a chunk (evidence to results) while
/// the engine aligns the next one; two chunks at most are in memory. References must outlive it.
class Batch {
 public:
  /// @param variants of the pairs 0 to pairs - 1, in that order.
  /// @param priors of the pairs, or none.
  Batch(Engine& engine, const std::vector<PairVariant>& variants,
        const std::vector<RegistrationPrior>& priors, const RegistrationOptions& options,
        const BatchCallbacks& callbacks, std::size_t pairs);

  /// The results of all pairs. Rethrows what the engine or a callback throws, the error of the
  /// earlier chunk first.
  std::vector<RegistrationResult> run();

 private:
  struct Chunk {
    const RegistrationOptions* options = nullptr;
    std::vector<PairVariant> variants;  ///< all of each of its pairs
    std::vector<PairInput> inputs;
    std::vector<PairOutcome> outcomes;
    std::size_t size() const { return variants.size(); }
  };
  /// Pairs that wait for a pass, and the number of their variants.
  struct Queue {
    std::vector<std::size_t> pairs;
    std::size_t next = 0, variants = 0;
  };
  std::size_t variants_of_pair(std::size_t pair) const { return first_[pair + 1] - first_[pair]; }
  void add(Queue& queue, std::size_t pair) const;
  /// The next chunk, none if nothing waits or if the batch has been stopped.
  Chunk next_chunk();
  /// True where undecided pairs should not wait any longer.
  bool is_full_due() const;
  Chunk take(Queue& queue, const RegistrationOptions& options) const;
  void align(Chunk& chunk) const;
  /// Results of an aligned chunk, to the callback too.
  void conclude(const Chunk& chunk);
  RegistrationResult result_of(const Chunk& chunk, std::size_t place) const;
  /// Takes the results of all variants of a pair.
  void settle(std::size_t pair, RegistrationResult* found, const RegistrationOptions& options);

  Engine& engine_;
  const std::vector<PairVariant>& variants_;
  const std::vector<RegistrationPrior>& priors_;
  const RegistrationOptions& options_;
  const BatchCallbacks& callbacks_;
  const std::optional<RegistrationOptions> first_pass_;
  std::vector<std::size_t> first_;  ///< per pair its first variant, and the number of variants
  Queue first_queue_, full_queue_;
  bool stopped_ = false;
  std::vector<RegistrationResult> results_;
  std::vector<bool> settled_;
  std::size_t delivered_ = 0;
};

}  // namespace gpureg
