// SPDX-License-Identifier: BSD-3-Clause
#include "gpureg/registration.hpp"

#include <algorithm>
#include <string>

#include "api/access.hpp"
#include "api/name_cloud.hpp"
#include "api/outcome.hpp"
#include "api/pair_input.hpp"
#include "api/prior.hpp"
#include "api/raw_cloud.hpp"
#include "api/unknown_viewpoint.hpp"
#include "api/variants.hpp"
#include "common/host_threads.hpp"
#include "common/in_halves.hpp"
#include "common/limits.hpp"
#include "common/validate.hpp"

namespace gpureg {
namespace {

void check_priors(const std::vector<RegistrationPrior>& priors, std::size_t pairs,
                  const RegistrationOptions& options) {
  if (priors.empty()) return;
  if (priors.size() != pairs)
    throw InvalidArgument("priors has " + std::to_string(priors.size()) +
                          " entries, but pairs has " + std::to_string(pairs));
  for (std::size_t p = 0; p < priors.size(); ++p) {
    priors[p].validate("priors[" + std::to_string(p) + "]");
    if (!priors[p].empty())
      require(options.method == RegistrationMethod::compatibility, "method",
              to_string(options.method), "compatibility: only it can use priors");
  }
}

}  // namespace

std::vector<PreparedCloud> prepare_batch(const Context& context,
                                         const std::vector<PointCloudView>& clouds,
                                         const PrepareOptions& options,
                                         const std::vector<std::string>& names) {
  options.validate();
  check_names(names, clouds.size());
  const auto naming = [&](std::size_t k, auto&& action) {
    return naming_cloud(names, clouds.size(), k, action);
  };
  std::vector<RawCloud> raw;
  raw.reserve(clouds.size());
  std::vector<FrameOrigin> frame_origins(clouds.size());
  std::vector<CloudKnowledge> knowledge;
  for (std::size_t k = 0; k < clouds.size(); ++k) {
    raw.push_back(naming(k, [&] { return raw_cloud(clouds[k]); }));
    knowledge.push_back(knowledge_of(clouds[k]));
    view_from_frame_origin(clouds[k].origin, frame_origins[k], raw.back());
  }
  std::vector<PreparedCloud> out;
  if (raw.empty()) return out;
  std::vector<std::shared_ptr<PreparedState>> states;
  in_halves(0, raw.size(), [&](std::size_t begin, std::size_t end) {
    const auto work = [&] {
      return Access::engine(context)->prepare({raw.data() + begin, end - begin}, options);
    };
    for (auto& state : end - begin == 1 ? naming(begin, work) : work()) {
      set_frame_offset(clouds[states.size()].origin, *state);
      states.push_back(std::move(state));
    }
  });
  resolve_viewpoints(*Access::engine(context), span_of(raw), knowledge, options, states);
  for (auto& state : states) out.push_back(Access::cloud(std::move(state)));
  return out;
}

PreparedCloud prepare(const Context& context, const PointCloudView& cloud,
                      const PrepareOptions& options) {
  return prepare_batch(context, {cloud}, options).front();
}

RegistrationResult align(const Context& context, const PreparedCloud& source,
                         const PreparedCloud& target, const RegistrationOptions& options) {
  return align_batch(context, {source, target}, {{0, 1}}, options).front();
}

RegistrationResult align(const Context& context, const PointCloudView& source,
                         const PointCloudView& target, const RegistrationOptions& options) {
  options.validate();
  return align_batch(
             context,
             prepare_batch(context, {source, target}, options.prepare, {"source", "target"}),
             {{0, 1}}, options)
      .front();
}

RegistrationResult align(const Context& context, const PreparedCloud& source,
                         const PreparedCloud& target,
                         const std::vector<Correspondence>& correspondences,
                         const RegistrationOptions& options) {
  options.validate();
  const PreparedState& s = *checked_state(context, source, options, "source");
  const PreparedState& t = *checked_state(context, target, options, "target");
  require(correspondences.size() <= limits::kMaxPoints, "correspondences.size",
          correspondences.size(), "at most 2^31 - 1");
  const bool swapped = swaps(s, t, options);
  std::vector<std::uint32_t> from, to;
  for (std::size_t k = 0; k < correspondences.size(); ++k) {
    const Correspondence& c = correspondences[k];
    if (c.source >= s.size || c.target >= t.size)
      throw InvalidArgument("correspondences[" + std::to_string(k) + "] is (" +
                            std::to_string(c.source) + ", " + std::to_string(c.target) +
                            "), but the clouds have " + std::to_string(s.size) + " and " +
                            std::to_string(t.size) + " points");
    from.push_back(swapped ? c.target : c.source);
    to.push_back(swapped ? c.source : c.target);
  }
  PairInput input = input_of(s, t, swapped);
  input.custom_source = span_of(from);
  input.custom_target = span_of(to);
  PairOutcome outcome;
  if (correspondences.empty()) {
    // Without correspondences there is nothing to search, and the engine takes an empty list for
    // "use the features".
    outcome.statistics.source_points = input.source->size;
    outcome.statistics.target_points = input.target->size;
    outcome.reason = RegistrationReason::no_usable_features;
  } else {
    Access::engine(context)->align({&input, 1}, options, {&outcome, 1});
  }
  return to_result(outcome, s, t, swapped, options);
}

RegistrationResult align(const Context& context, const PreparedCloud& source,
                         const PreparedCloud& target, const RegistrationPrior& prior,
                         const RegistrationOptions& options) {
  prior.validate();
  return align_batch(context, {source, target}, {{0, 1}}, {prior}, options).front();
}

std::vector<RegistrationResult> align_batch(const Context& context,
                                            const std::vector<PreparedCloud>& clouds,
                                            const std::vector<Pair>& pairs,
                                            const RegistrationOptions& options,
                                            const BatchCallbacks& callbacks) {
  return align_batch(context, clouds, pairs, std::vector<RegistrationPrior>(), options, callbacks);
}

std::vector<RegistrationResult> align_batch(const Context& context,
                                            const std::vector<PreparedCloud>& clouds,
                                            const std::vector<Pair>& pairs,
                                            const std::vector<RegistrationPrior>& priors,
                                            const RegistrationOptions& options,
                                            const BatchCallbacks& callbacks) {
  options.validate();
  check_priors(priors, pairs.size(), options);
  check_pairs(context, clouds, pairs, options);

  std::vector<RegistrationResult> results(pairs.size());
  const std::vector<PairVariant> variants = variants_of(clouds, pairs);
  const std::size_t chunk = Access::engine(context)->pairs_per_chunk(options);
  for (std::size_t begin = 0; begin < variants.size(); begin += chunk) {
    if (callbacks.should_stop && callbacks.should_stop()) {
      // A pair of which only some variants were aligned counts as never tried.
      if (begin > 0 && variants[begin].pair == variants[begin - 1].pair)
        results[variants[begin].pair] = {};
      break;
    }
    const std::size_t end = std::min(variants.size(), begin + chunk);
    std::vector<PairInput> inputs;
    std::vector<PairOutcome> outcomes(end - begin);
    std::vector<RegistrationResult> found(end - begin);
    for (std::size_t v = begin; v < end; ++v) {
      const PreparedState &s = *variants[v].source, &t = *variants[v].target;
      const bool swapped = swaps(s, t, options);
      inputs.push_back(input_of(s, t, swapped));
      if (!priors.empty())
        inputs.back().prior = prior_test(priors[variants[v].pair], s, t, swapped);
    }
    align_all(*Access::engine(context), inputs, options, outcomes);
    // A result by evidence takes about 50 us on the host, too much for one thread where a device
    // makes ten thousand per second.
    const std::size_t workers =
        std::min<std::size_t>(Access::engine(context)->host_threads(), 1 + (end - begin) / 16);
    on_threads(workers, [&](std::size_t worker) {
      for (std::size_t v = begin + worker; v < end; v += workers) {
        const PreparedState &s = *variants[v].source, &t = *variants[v].target;
        found[v - begin] = to_result(outcomes[v - begin], s, t, swaps(s, t, options), options,
                                     inputs[v - begin].prior);
      }
    });
    for (std::size_t v = begin; v < end; ++v) {
      const std::size_t p = variants[v].pair;
      keep_better(std::move(found[v - begin]), results[p]);
      const bool last = v + 1 == variants.size() || variants[v + 1].pair != p;
      if (last && callbacks.on_result) callbacks.on_result(p, results[p]);
    }
  }
  return results;
}

}  // namespace gpureg
