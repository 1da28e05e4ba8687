// SPDX-License-Identifier: BSD-3-Clause
#include "api/batch.hpp"

#include <algorithm>
#include <atomic>
#include <utility>

#include "api/outcome.hpp"
#include "api/pair_input.hpp"
#include "api/prior.hpp"
#include "common/host_threads.hpp"

namespace gpureg {

Batch::Batch(Engine& engine, const std::vector<PairVariant>& variants,
             const std::vector<RegistrationPrior>& priors, const RegistrationOptions& options,
             const BatchCallbacks& callbacks, std::size_t pairs)
    : engine_(engine),
      variants_(variants),
      priors_(priors),
      options_(options),
      callbacks_(callbacks),
      results_(pairs) {}

Batch::Chunk Batch::chunk_of(std::size_t begin, std::size_t end) const {
  Chunk out{begin, end, {}, std::vector<PairOutcome>(end - begin)};
  out.inputs.reserve(end - begin);
  for (std::size_t v = begin; v < end; ++v) {
    const PreparedState &s = *variants_[v].source, &t = *variants_[v].target;
    const bool swapped = swaps(s, t, options_);
    out.inputs.push_back(input_of(s, t, swapped));
    if (!priors_.empty())
      out.inputs.back().prior = prior_test(priors_[variants_[v].pair], s, t, swapped);
  }
  return out;
}

void Batch::align(Chunk& chunk) const {
  align_all(engine_, chunk.inputs, options_, chunk.outcomes);
}

RegistrationResult Batch::result_of(const Chunk& chunk, std::size_t variant) const {
  const PreparedState &s = *variants_[variant].source, &t = *variants_[variant].target;
  const std::size_t place = variant - chunk.begin;
  return to_result(chunk.outcomes[place], {s, t, swaps(s, t, options_), options_},
                   chunk.inputs[place].prior);
}

void Batch::conclude(const Chunk& chunk) {
  std::vector<RegistrationResult> found(chunk.size());
  // A result by evidence takes about 100 us on the host, too much for one thread where a device
  // makes thousands per second. A pair whose symmetry is tested takes milliseconds, so the threads
  // take one pair after the other.
  const std::size_t workers = std::min<std::size_t>(engine_.host_threads(), 1 + chunk.size() / 16);
  std::atomic<std::size_t> next{chunk.begin};
  on_threads(workers, [&](std::size_t) {
    for (std::size_t v = next++; v < chunk.end; v = next++)
      found[v - chunk.begin] = result_of(chunk, v);
  });
  for (std::size_t v = chunk.begin; v < chunk.end; ++v) {
    const std::size_t p = variants_[v].pair;
    keep_better(std::move(found[v - chunk.begin]), results_[p]);
    const bool last = v + 1 == variants_.size() || variants_[v + 1].pair != p;
    if (last && callbacks_.on_result) callbacks_.on_result(p, results_[p]);
  }
}

std::vector<RegistrationResult> Batch::run() {
  const bool overlap = engine_.leaves_host_idle();
  // Chunks of equal size: a small one at the end would not fill a device.
  const std::size_t size = variants_.size(), most = engine_.pairs_per_chunk(options_),
                    chunks = (size + most - 1) / most;
  Chunk before;  // aligned, without results yet
  for (std::size_t k = 0; k < chunks; ++k) {
    const std::size_t begin = k * size / chunks, end = (k + 1) * size / chunks;
    if (callbacks_.should_stop && callbacks_.should_stop()) {
      conclude(std::exchange(before, Chunk()));
      // A pair of which only some variants were aligned counts as never tried.
      if (begin > 0 && variants_[begin].pair == variants_[begin - 1].pair)
        results_[variants_[begin].pair] = {};
      break;
    }
    Chunk now = chunk_of(begin, end);
    if (overlap && before.size() > 0) {
      // Callbacks stay in the thread of the caller.
      on_threads(2, [&](std::size_t part) { part == 0 ? conclude(before) : align(now); });
    } else {
      align(now);
    }
    before = std::move(now);
    if (!overlap) conclude(std::exchange(before, Chunk()));
  }
  if (before.size() > 0) conclude(before);
  return std::move(results_);
}

}  // namespace gpureg
