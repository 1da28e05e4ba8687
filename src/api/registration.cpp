// SPDX-License-Identifier: BSD-3-Clause
#include "gpureg/registration.hpp"

#include <algorithm>
#include <optional>
#include <string>

#include "api/access.hpp"
#include "api/batch.hpp"
#include "api/engine_calls.hpp"
#include "api/name_cloud.hpp"
#include "api/outcome.hpp"
#include "api/pair_input.hpp"
#include "api/raw_cloud.hpp"
#include "api/variants.hpp"
#include "api/with_settings.hpp"
#include "common/host_threads.hpp"
#include "common/in_halves.hpp"
#include "common/limits.hpp"
#include "common/validate.hpp"
#include "flat/extruded.hpp"
#include "sensor_fixed/known.hpp"
#include "sensor_fixed/range_shells.hpp"
#include "spacing/stray_points.hpp"
#include "viewpoint/unknown_viewpoint.hpp"

namespace gpureg {
namespace {

void check_priors(const std::vector<RegistrationPrior>& priors, std::size_t pairs,
                  const RegistrationSettings& options) {
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

/// Points from which another thread is worth its start.
constexpr std::size_t kRawPointsPerThread = 200'000;

/// The owners of the rows that the engine gets of a cloud.
struct OwnedRows {
  WithoutRangeShells seen;
  Extruded extruded;
  WithoutStrayPoints kept;
  OwnedRows(const RawCloud& raw, const CloudKnowledge& known, const PrepareSettings& options)
      : seen(raw, options.keep_range_limits || !has_sensor_frame(known)),
        extruded(seen.cloud(), known.model, options),
        kept(extruded.cloud(), options) {}
  OwnedRows(const OwnedRows&) = delete;
  OwnedRows& operator=(const OwnedRows&) = delete;
};

/// Replaces clouds by those that the engine gets: without points at the limits of the range, 2-D
/// scans in layers, without stray points.
/// @return the owners of the rows.
template <typename Naming>
std::vector<std::optional<OwnedRows>> replace_rows(const Engine& engine,
                                                   const PrepareSettings& options,
                                                   const Naming& naming,
                                                   std::vector<CloudKnowledge>& knowledge,
                                                   std::vector<RawCloud>& raw) {
  std::vector<std::optional<OwnedRows>> owners(raw.size());
  std::size_t points = 0;
  for (const RawCloud& cloud : raw) points += cloud.size;
  const std::size_t workers = std::min<std::size_t>(
      {std::max(1u, engine.host_threads()), raw.size(), 1 + points / kRawPointsPerThread});
  on_threads(workers, [&](std::size_t worker) {
    for (std::size_t k = worker; k < raw.size(); k += workers)
      naming(k, [&] {
        const OwnedRows& rows = owners[k].emplace(raw[k], knowledge[k], options);
        raw[k] = rows.kept.cloud();
        knowledge[k].flat = rows.extruded.plane().exists();
        // The origin of the frame may be below the scanner.
        if (knowledge[k].flat && !knowledge[k].viewpoints && raw[k].viewpoints)
          for (int axis = 0; axis < 3; ++axis)
            knowledge[k].origin[axis] = -static_cast<double>(raw[k].viewpoints[axis]);
      });
  });
  return owners;
}

/// @param scales of copies of one cloud that are for matches alone, or none.
std::vector<PreparedCloud> prepare_all(const Context& context,
                                       const std::vector<PointCloudView>& clouds,
                                       const PrepareSettings& options,
                                       const std::vector<std::string>& names,
                                       const std::vector<double>& scales) {
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
    raw.push_back(naming(k, [&] {
      const RawCloud cloud = raw_cloud(clouds[k]);
      Access::engine(context)->check_on_host(cloud);
      return cloud;
    }));
    raw.back().matched_only = !scales.empty();
    knowledge.push_back(knowledge_of(clouds[k]));
    view_from_frame_origin(clouds[k].origin, frame_origins[k], raw.back());
  }
  std::vector<PreparedCloud> out;
  if (raw.empty()) return out;
  const auto owners = replace_rows(*Access::engine(context), options, naming, knowledge, raw);
  UnknownViewpoints unknown(*Access::engine(context), span_of(raw), knowledge, options, scales);
  std::vector<std::shared_ptr<PreparedState>> states;
  unknown.during([&](const SurfaceWatcher& watcher) {
    in_halves(0, raw.size(), [&](std::size_t begin, std::size_t end) {
      const auto work = [&] {
        Engine& engine = *Access::engine(context);
        const Span<const RawCloud> run{raw.data() + begin, end - begin};
        if (!watcher) return engine.prepare(run, options);
        return engine.prepare_watched(run, options, [&](std::size_t first, auto surfaces) {
          watcher(begin + first, std::move(surfaces));
        });
      };
      for (auto& state : end - begin == 1 ? naming(begin, work) : work()) {
        set_frame_offset(clouds[states.size()].origin, *state);
        const OwnedRows& rows = *owners[states.size()];
        state->plane = rows.extruded.plane();
        rows.kept.count(state->statistics);
        rows.extruded.count(state->statistics);
        rows.seen.count(state->statistics);
        states.push_back(std::move(state));
      }
    });
  });
  for (std::size_t k = 0; k < states.size(); ++k)
    naming(k, [&] { check_viewpoints(knowledge[k], *states[k]); });
  unknown.resolve(states);
  for (auto& state : states) out.push_back(Access::cloud(std::move(state)));
  return out;
}

}  // namespace

std::vector<PreparedCloud> prepare_batch(const Context& context,
                                         const std::vector<PointCloudView>& clouds,
                                         const PrepareSettings& options,
                                         const std::vector<std::string>& names) {
  return prepare_all(context, clouds, options, names, {});
}

std::vector<PreparedCloud> prepare_copies(const Context& context,
                                          const std::vector<PointCloudView>& copies,
                                          const std::vector<double>& scales,
                                          const PrepareSettings& options) {
  return prepare_all(context, copies, options, {}, scales);
}

std::vector<PreparedCloud> prepare_batch(const Context& context,
                                         const std::vector<PointCloudView>& clouds,
                                         const RegistrationOptions& options,
                                         const std::vector<std::string>& names) {
  return prepare_batch(context, clouds, resolve(options).prepare, names);
}

PreparedCloud prepare(const Context& context, const PointCloudView& cloud,
                      const PrepareSettings& options) {
  return prepare_batch(context, {cloud}, options).front();
}

PreparedCloud prepare(const Context& context, const PointCloudView& cloud,
                      const RegistrationOptions& options) {
  return prepare(context, cloud, resolve(options).prepare);
}

RegistrationResult align(const Context& context, const PreparedCloud& source,
                         const PreparedCloud& target, const RegistrationSettings& options) {
  return align_batch(context, {source, target}, {{0, 1}}, options).front();
}

RegistrationResult align(const Context& context, const PreparedCloud& source,
                         const PreparedCloud& target, const RegistrationOptions& options) {
  return align(context, source, target, resolve(options));
}

RegistrationResult align(const Context& context, const PointCloudView& source,
                         const PointCloudView& target, const RegistrationSettings& settings) {
  const std::vector<PreparedCloud> clouds =
      prepare_batch(context, {source, target}, settings.prepare, {"source", "target"});
  return align(context, clouds[0], clouds[1], settings);
}

RegistrationResult align(const Context& context, const PointCloudView& source,
                         const PointCloudView& target, const RegistrationOptions& options) {
  return align(context, source, target, resolve(options));
}

RegistrationResult align(const Context& context, const PreparedCloud& source,
                         const PreparedCloud& target,
                         const std::vector<Correspondence>& correspondences,
                         const RegistrationOptions& options) {
  return align(context, source, target, correspondences, resolve(options));
}

RegistrationResult align(const Context& context, const PreparedCloud& source,
                         const PreparedCloud& target, const RegistrationPrior& prior,
                         const RegistrationOptions& options) {
  return align(context, source, target, prior, resolve(options));
}

RegistrationResult align(const Context& context, const PreparedCloud& source,
                         const PreparedCloud& target,
                         const std::vector<Correspondence>& correspondences,
                         const RegistrationSettings& options) {
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
  // The other sides of a cloud have its points in its order.
  RegistrationResult result;
  for (const PairVariant& variant : variants_of({source, target}, {{0, 1}})) {
    PairInput input = input_of(*variant.source, *variant.target, swapped);
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
      align_all(*Access::engine(context), {&input, 1}, options, {&outcome, 1});
    }
    keep_better(to_result(outcome, {*variant.source, *variant.target, swapped, options}), result);
  }
  return result;
}

RegistrationResult align(const Context& context, const PreparedCloud& source,
                         const PreparedCloud& target, const RegistrationPrior& prior,
                         const RegistrationSettings& options) {
  prior.validate();
  return align_batch(context, {source, target}, {{0, 1}}, {prior}, options).front();
}

std::vector<RegistrationResult> align_batch(const Context& context,
                                            const std::vector<PreparedCloud>& clouds,
                                            const std::vector<Pair>& pairs,
                                            const RegistrationSettings& options,
                                            const BatchCallbacks& callbacks) {
  return align_batch(context, clouds, pairs, std::vector<RegistrationPrior>(), options, callbacks);
}

std::vector<RegistrationResult> align_batch(const Context& context,
                                            const std::vector<PreparedCloud>& clouds,
                                            const std::vector<Pair>& pairs,
                                            const RegistrationOptions& options,
                                            const BatchCallbacks& callbacks) {
  return align_batch(context, clouds, pairs, resolve(options), callbacks);
}

std::vector<RegistrationResult> align_batch(const Context& context,
                                            const std::vector<PreparedCloud>& clouds,
                                            const std::vector<Pair>& pairs,
                                            const std::vector<RegistrationPrior>& priors,
                                            const RegistrationOptions& options,
                                            const BatchCallbacks& callbacks) {
  return align_batch(context, clouds, pairs, priors, resolve(options), callbacks);
}

std::vector<RegistrationResult> align_batch(const Context& context,
                                            const std::vector<PreparedCloud>& clouds,
                                            const std::vector<Pair>& pairs,
                                            const std::vector<RegistrationPrior>& priors,
                                            const RegistrationSettings& options,
                                            const BatchCallbacks& callbacks) {
  options.validate();
  check_priors(priors, pairs.size(), options);
  check_pairs(context, clouds, pairs, options);

  const std::vector<PairVariant> variants = variants_of(clouds, pairs);
  Batch batch(*Access::engine(context), variants, priors, options, callbacks, pairs.size());
  return batch.run();
}

}  // namespace gpureg
