// SPDX-License-Identifier: BSD-3-Clause
#include "gpureg/registration.hpp"

#include <algorithm>
#include <string>

#include "api/outcome.hpp"
#include "api/prior.hpp"
#include "api/slide.hpp"
#include "api/validate.hpp"
#include "pipeline/host_threads.hpp"

namespace gpureg {
namespace {

RawCloud raw_of(const PointCloudView& v) {
  v.validate();
  return {v.points,
          v.size,
          v.point_stride,
          v.normals,
          v.normal_stride,
          v.features,
          v.feature_dimension,
          v.feature_stride ? v.feature_stride : v.feature_dimension,
          v.viewpoints,
          v.viewpoint_count};
}

/// A cloud that this context and these options can work with. name: for the message.
const PreparedState* checked(const Context& context, const PreparedCloud& cloud,
                             const RegistrationOptions& options, const std::string& name) {
  if (!cloud.valid())
    throw InvalidArgument(name + " is an empty handle: it was not made by prepare()");
  const PreparedState& state = *cloud.state();
  if (state.owner != context.engine()->memory())
    throw InvalidArgument(name + " was prepared by a context of another backend or device than " +
                          context.description());
  const float needed = options.refine.max_iterations > 0
                           ? std::max(options.score.max_correspondence_distance,
                                      options.refine.max_correspondence_distance)
                           : options.score.max_correspondence_distance;
  if (needed > state.options.search_distance)
    throw InvalidArgument(name + " was prepared with search_distance " +
                          std::to_string(state.options.search_distance) +
                          ", less than the correspondence distance " + std::to_string(needed) +
                          " asked for now");
  return &state;
}

void check_dimensions(const PreparedState& source, const PreparedState& target) {
  if (source.feature_dimension != target.feature_dimension)
    throw InvalidArgument("feature_dimension differs: source has " +
                          std::to_string(source.feature_dimension) + ", target has " +
                          std::to_string(target.feature_dimension));
}

bool swaps(const PreparedState& source, const PreparedState& target,
           const HypothesisOptions& options) {
  return options.smaller_as_source && target.size < source.size;
}

PairInput input_of(const PreparedState& source, const PreparedState& target, bool swapped) {
  return swapped ? PairInput{&target, &source, {}, {}} : PairInput{&source, &target, {}, {}};
}

/// For the engine: where to look further, some 50 us a pair.
FurtherSearch further_search(const Context& context, const RegistrationOptions& options) {
  return [&](Span<const PairInput> pairs, Span<const PairOutcome> outcomes) {
    std::vector<FurtherPoses> out(pairs.size);
    const std::size_t workers =
        std::min<std::size_t>(context.engine()->host_threads(), 1 + pairs.size / 16);
    on_threads(workers, [&](std::size_t worker) {
      for (std::size_t p = worker; p < pairs.size; p += workers)
        out[p] = slide(pairs.data[p], outcomes.data[p], options);
    });
    return out;
  };
}

void check_priors(const std::vector<RegistrationPrior>& priors, std::size_t pairs,
                  const RegistrationOptions& options) {
  if (priors.empty()) return;
  if (priors.size() != pairs)
    throw InvalidArgument("priors has " + std::to_string(priors.size()) +
                          " entries, but pairs has " + std::to_string(pairs));
  for (std::size_t p = 0; p < priors.size(); ++p) {
    priors[p].validate("priors[" + std::to_string(p) + "]");
    if (!priors[p].empty())
      require(options.hypothesis.proposal == Proposal::compatibility, "hypothesis.proposal",
              to_string(options.hypothesis.proposal), "compatibility: only it can use priors");
  }
}

}  // namespace

std::vector<PreparedCloud> prepare_batch(const Context& context,
                                         const std::vector<PointCloudView>& clouds,
                                         const PrepareOptions& options,
                                         const std::vector<std::string>& names) {
  options.validate();
  if (!names.empty() && names.size() != clouds.size())
    throw InvalidArgument("names has " + std::to_string(names.size()) +
                          " entries, but clouds has " + std::to_string(clouds.size()));
  const auto naming = [&](std::size_t k, auto&& action) {
    try {
      return action();
    } catch (const InvalidArgument& error) {
      if (names.empty() && clouds.size() == 1) throw;
      throw InvalidArgument((names.empty() ? "clouds[" + std::to_string(k) + "]" : names[k]) +
                            ": " + error.what());
    }
  };
  std::vector<RawCloud> raw;
  raw.reserve(clouds.size());
  for (std::size_t k = 0; k < clouds.size(); ++k)
    raw.push_back(naming(k, [&] { return raw_of(clouds[k]); }));
  std::vector<PreparedCloud> out;
  if (raw.empty()) return out;
  try {
    for (auto& state : context.engine()->prepare(span_of(raw), options))
      out.emplace_back(std::move(state));
  } catch (const InvalidArgument&) {
    // Stages see all clouds at once: alone the one that it is about says so again.
    for (std::size_t k = 0; k < raw.size(); ++k)
      naming(k, [&] { return context.engine()->prepare({&raw[k], 1}, options); });
    throw;
  }
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
  const PreparedState& s = *checked(context, source, options, "source");
  const PreparedState& t = *checked(context, target, options, "target");
  require(correspondences.size() <= 0x7fffffffu, "correspondences.size", correspondences.size(),
          "at most 2^31 - 1");
  const bool swapped = swaps(s, t, options.hypothesis);
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
    // Without any there is nothing to search, and the engine would take "none given" for "use the
    // features".
    outcome.statistics.source_points = input.source->size;
    outcome.statistics.target_points = input.target->size;
    outcome.reason = RegistrationReason::no_usable_features;
  } else {
    context.engine()->align({&input, 1}, options, {&outcome, 1}, further_search(context, options));
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
  // Everything that can be wrong is looked at before the first pair runs: a long batch does not die
  // of its last line.
  std::vector<std::uint8_t> used(clouds.size(), 0);
  for (std::size_t p = 0; p < pairs.size(); ++p) {
    for (const std::uint32_t k : {pairs[p].source, pairs[p].target}) {
      if (k >= clouds.size())
        throw InvalidArgument("pairs[" + std::to_string(p) + "] names cloud " + std::to_string(k) +
                              ", but there are " + std::to_string(clouds.size()));
      if (!used[k]) checked(context, clouds[k], options, "clouds[" + std::to_string(k) + "]");
      used[k] = 1;
    }
    check_dimensions(*clouds[pairs[p].source].state(), *clouds[pairs[p].target].state());
  }

  std::vector<RegistrationResult> results(pairs.size());
  const std::size_t chunk = context.engine()->pairs_per_chunk(options);
  for (std::size_t begin = 0; begin < pairs.size(); begin += chunk) {
    if (callbacks.should_stop && callbacks.should_stop()) break;
    const std::size_t end = std::min(pairs.size(), begin + chunk);
    std::vector<PairInput> inputs;
    std::vector<PairOutcome> outcomes(end - begin);
    for (std::size_t p = begin; p < end; ++p) {
      const PreparedState &s = *clouds[pairs[p].source].state(),
                          &t = *clouds[pairs[p].target].state();
      const bool swapped = swaps(s, t, options.hypothesis);
      inputs.push_back(input_of(s, t, swapped));
      if (!priors.empty()) inputs.back().prior = prior_test(priors[p], s, t, swapped);
    }
    context.engine()->align(span_of(inputs), options, {outcomes.data(), outcomes.size()},
                            further_search(context, options));
    // A result by evidence takes some 50 us, which counts where a device makes ten thousand in a
    // second.
    const std::size_t workers =
        std::min<std::size_t>(context.engine()->host_threads(), 1 + (end - begin) / 16);
    on_threads(workers, [&](std::size_t worker) {
      for (std::size_t p = begin + worker; p < end; p += workers) {
        const PreparedState &s = *clouds[pairs[p].source].state(),
                            &t = *clouds[pairs[p].target].state();
        results[p] = to_result(outcomes[p - begin], s, t, swaps(s, t, options.hypothesis), options,
                               inputs[p - begin].prior);
      }
    });
    for (std::size_t p = begin; p < end && callbacks.on_result; ++p)
      callbacks.on_result(p, results[p]);
  }
  return results;
}

}  // namespace gpureg
