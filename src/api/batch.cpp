// SPDX-License-Identifier: BSD-3-Clause
#include "api/batch.hpp"

#include <algorithm>
#include <utility>

#include "api/engine_calls.hpp"
#include "api/outcome.hpp"
#include "common/for_each_on.hpp"
#include "common/host_threads.hpp"
#include "common/stop_scope.hpp"

namespace gpureg {
namespace {

/// Keeps the result with the higher confidence, up to a symmetry, the first one of equals, and the
/// time of both.
void keep_better(RegistrationResult&& candidate, RegistrationResult& kept) {
  const bool first = kept.status == RegistrationStatus::skipped;
  StageTimings sum = candidate.timings;
  sum += kept.timings;
  const auto better = [&] {
    if (candidate.has_pose() != kept.has_pose()) return candidate.has_pose();
    const double together = candidate.symmetry_confidence(), before = kept.symmetry_confidence();
    if (together != before) return together > before;
    return candidate.confidence > kept.confidence;
  };
  if (first || better()) kept = std::move(candidate);
  kept.timings = sum;
}

}  // namespace

Batch::Batch(Engine& engine, const std::vector<PairVariant>& variants,
             const std::vector<RegistrationPrior>& priors, const RegistrationSettings& options,
             const BatchCallbacks& callbacks, std::size_t pairs)
    : engine_(engine),
      variants_(variants),
      priors_(priors),
      options_(options),
      callbacks_(callbacks),
      results_(pairs) {}

Batch::Chunk Batch::next_chunk() {
  Chunk out;
  const std::size_t left = variants_.size() - next_;
  if (left == 0 || (callbacks_.should_stop && callbacks_.should_stop())) {
    next_ = variants_.size();
    return out;
  }
  // Chunks of equal size: a small one at the end would not fill a device.
  const std::size_t most = engine_.pairs_per_chunk(options_), chunks = (left + most - 1) / most,
                    size = (left + chunks - 1) / chunks;
  std::size_t end = next_ + 1, variant = end;
  while (variant < variants_.size() && !starts_pair(variant)) end = ++variant;
  for (; variant <= variants_.size() && variant - next_ <= size; ++variant)
    if (variant == variants_.size() || starts_pair(variant)) end = variant;
  out.first = next_;
  const RegistrationPrior nothing;
  for (; next_ < end; ++next_) {
    const PairVariant& v = variants_[next_];
    const RegistrationPrior& prior = priors_.empty() ? nothing : priors_[v.pair];
    out.inputs.push_back(v.clouds.input(prior));
    if (!prior.correspondences) continue;
    // The other sides of a cloud have its points in its order.
    std::vector<std::uint32_t> source, target;
    for (const Correspondence& c : *prior.correspondences) {
      source.push_back(v.clouds.swapped ? c.target : c.source);
      target.push_back(v.clouds.swapped ? c.source : c.target);
    }
    out.inputs.back().custom_source = span_of(source);
    out.inputs.back().custom_target = span_of(target);
    out.given.push_back(std::move(source));
    out.given.push_back(std::move(target));
  }
  out.outcomes.resize(out.size());
  return out;
}

void Batch::align(Chunk& chunk) const {
  // Without correspondences there is nothing to search, and the engine takes an empty list for "use
  // the features".
  const auto has_nothing = [&](std::size_t k) {
    const std::size_t pair = variants_[chunk.first + k].pair;
    return !priors_.empty() && priors_[pair].correspondences &&
           priors_[pair].correspondences->empty();
  };
  for (std::size_t begin = 0, end = 0; begin < chunk.size(); begin = ++end) {
    while (end < chunk.size() && !has_nothing(end)) ++end;
    if (end > begin)
      align_all(engine_, {chunk.inputs.data() + begin, end - begin}, options_,
                {chunk.outcomes.data() + begin, end - begin});
    if (end == chunk.size()) break;
    PairOutcome& outcome = chunk.outcomes[end];
    outcome.statistics.source_points = chunk.inputs[end].source->size;
    outcome.statistics.target_points = chunk.inputs[end].target->size;
    outcome.reason = RegistrationReason::no_usable_features;
  }
}

void Batch::conclude(Chunk& chunk) {
  std::vector<RegistrationResult> found(chunk.size());
  // A result by evidence takes about 100 us on the host, too much for one thread where a device
  // makes thousands per second. A pair whose symmetry is tested takes milliseconds, so the threads
  // take one pair after the other.
  const std::size_t workers = std::min<std::size_t>(engine_.host_threads(), 1 + chunk.size() / 16);
  for_each_on(workers, chunk.size(), [&](std::size_t k) {
    found[k] = to_result(std::move(chunk.outcomes[k]), variants_[chunk.first + k].clouds,
                         chunk.inputs[k].prior);
  });
  for (std::size_t k = 0; k < chunk.size(); ++k) {
    const std::size_t variant = chunk.first + k, pair = variants_[variant].pair;
    keep_better(std::move(found[k]), results_[pair]);
    const bool last = variant + 1 == variants_.size() || starts_pair(variant + 1);
    if (last && callbacks_.on_result) callbacks_.on_result(pair, results_[pair]);
  }
}

std::vector<RegistrationResult> Batch::run() {
  const bool overlap = engine_.leaves_host_idle();
  Chunk before;  // aligned, without results yet
  for (;;) {
    StopScope::poll();
    Chunk now = next_chunk();
    if (now.size() == 0) break;
    if (overlap && before.size() > 0) {
      // Callbacks stay in the thread of the caller.
      on_threads(2, [&](std::size_t part) { part == 0 ? conclude(before) : align(now); });
    } else {
      align(now);
    }
    before = std::move(now);
    if (!overlap) {
      conclude(before);
      before = Chunk();
    }
  }
  if (before.size() > 0) conclude(before);
  return std::move(results_);
}

}  // namespace gpureg
