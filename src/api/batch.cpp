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

std::optional<RegistrationOptions> first_pass_of(const RegistrationOptions& options) {
  const CompatibilityOptions& c = options.compatibility;
  const RegistrationOptions few = options.with_quality(1);
  // Below four times its seeds a first pass costs more than it saves.
  if (options.method != RegistrationMethod::compatibility ||
      (c.first_pass_reject <= 0 && c.first_pass_accept >= 1) ||
      c.seeds < 4 * few.compatibility.seeds || options.evidence.modes <= few.evidence.modes)
    return std::nullopt;
  return few;
}

Batch::Batch(Engine& engine, const std::vector<PairVariant>& variants,
             const std::vector<RegistrationPrior>& priors, const RegistrationOptions& options,
             const BatchCallbacks& callbacks, std::size_t pairs)
    : engine_(engine),
      variants_(variants),
      priors_(priors),
      options_(options),
      callbacks_(callbacks),
      first_pass_(first_pass_of(options)),
      results_(pairs),
      settled_(pairs, false) {
  for (std::size_t v = 0; v < variants.size(); ++v)
    if (v == 0 || variants[v].pair != variants[v - 1].pair) first_.push_back(v);
  first_.push_back(variants.size());
  for (std::size_t p = 0; p < pairs; ++p) add(first_pass_ ? first_queue_ : full_queue_, p);
}

void Batch::add(Queue& queue, std::size_t pair) const {
  queue.pairs.push_back(pair);
  queue.variants += variants_of_pair(pair);
}

Batch::Chunk Batch::take(Queue& queue, const RegistrationOptions& options) const {
  // Chunks of equal size: a small one at the end would not fill a device.
  const std::size_t most = engine_.pairs_per_chunk(options),
                    chunks = (queue.variants + most - 1) / most,
                    size = (queue.variants + chunks - 1) / chunks;
  Chunk out;
  out.options = &options;
  while (queue.next < queue.pairs.size()) {
    const std::size_t pair = queue.pairs[queue.next], more = variants_of_pair(pair);
    if (out.size() > 0 && out.size() + more > size) break;
    out.variants.insert(out.variants.end(),
                        variants_.begin() + static_cast<std::ptrdiff_t>(first_[pair]),
                        variants_.begin() + static_cast<std::ptrdiff_t>(first_[pair + 1]));
    queue.variants -= more;
    ++queue.next;
  }
  for (const PairVariant& v : out.variants) {
    const bool swapped = swaps(*v.source, *v.target, options);
    out.inputs.push_back(input_of(*v.source, *v.target, swapped));
    if (!priors_.empty())
      out.inputs.back().prior = prior_test(priors_[v.pair], *v.source, *v.target, swapped);
  }
  out.outcomes.resize(out.size());
  return out;
}

bool Batch::is_full_due() const {
  constexpr std::size_t kChunksBehind = 4;  // results come in order: they wait for the undecided
  const std::size_t most = engine_.pairs_per_chunk(options_);
  return full_queue_.variants >= most || first_queue_.next - delivered_ >= kChunksBehind * most;
}

Batch::Chunk Batch::next_chunk() {
  const bool more = first_queue_.variants > 0 && !stopped_;
  // After a stop the pairs that began are finished.
  const bool waits = full_queue_.variants > 0 && (first_pass_ || !stopped_);
  if (waits && (!more || is_full_due())) return take(full_queue_, options_);
  return more ? take(first_queue_, *first_pass_) : Chunk();
}

void Batch::align(Chunk& chunk) const {
  align_all(engine_, chunk.inputs, *chunk.options, chunk.outcomes);
}

RegistrationResult Batch::result_of(const Chunk& chunk, std::size_t place) const {
  const PreparedState &s = *chunk.variants[place].source, &t = *chunk.variants[place].target;
  return to_result(chunk.outcomes[place], {s, t, swaps(s, t, *chunk.options), *chunk.options},
                   chunk.inputs[place].prior);
}

void Batch::settle(std::size_t pair, RegistrationResult* found,
                   const RegistrationOptions& options) {
  RegistrationResult best;
  for (std::size_t k = 0; k < variants_of_pair(pair); ++k) keep_better(std::move(found[k]), best);
  const double confidence = best.symmetry_confidence();
  const CompatibilityOptions& c = options_.compatibility;
  // A calibration changes confidences alone, so it applies to the limits as well.
  const ConfidenceCalibration& calibrated = options_.calibration;
  const bool decided = &options == &options_ ||
                       (best.has_candidate && (confidence < calibrated(c.first_pass_reject) ||
                                               confidence > calibrated(c.first_pass_accept)));
  best.timings += results_[pair].timings;
  results_[pair] = std::move(best);
  if (decided)
    settled_[pair] = true;
  else
    add(full_queue_, pair);
}

void Batch::conclude(const Chunk& chunk) {
  std::vector<RegistrationResult> found(chunk.size());
  // A result by evidence takes about 100 us on the host, too much for one thread where a device
  // makes thousands per second. A pair whose symmetry is tested takes milliseconds, so the threads
  // take one pair after the other.
  const std::size_t workers = std::min<std::size_t>(engine_.host_threads(), 1 + chunk.size() / 16);
  std::atomic<std::size_t> next{0};
  on_threads(workers, [&](std::size_t) {
    for (std::size_t k = next++; k < chunk.size(); k = next++) found[k] = result_of(chunk, k);
  });
  for (std::size_t k = 0; k < chunk.size(); k += variants_of_pair(chunk.variants[k].pair))
    settle(chunk.variants[k].pair, &found[k], *chunk.options);
  for (; delivered_ < results_.size() && settled_[delivered_]; ++delivered_)
    if (callbacks_.on_result) callbacks_.on_result(delivered_, results_[delivered_]);
}

std::vector<RegistrationResult> Batch::run() {
  const bool overlap = engine_.leaves_host_idle();
  Chunk before;  // aligned, without results yet
  for (;;) {
    if (!stopped_ && callbacks_.should_stop && first_queue_.variants + full_queue_.variants > 0)
      stopped_ = callbacks_.should_stop();
    Chunk now = next_chunk();
    if (now.size() == 0) {
      if (before.size() == 0) break;
      conclude(std::exchange(before, Chunk()));  // it may leave undecided pairs
      continue;
    }
    if (overlap && before.size() > 0) {
      // Callbacks stay in the thread of the caller.
      on_threads(2, [&](std::size_t part) { part == 0 ? conclude(before) : align(now); });
    } else {
      align(now);
    }
    before = std::move(now);
    if (!overlap) conclude(std::exchange(before, Chunk()));
  }
  return std::move(results_);
}

}  // namespace gpureg
