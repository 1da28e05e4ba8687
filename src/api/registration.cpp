// SPDX-License-Identifier: BSD-3-Clause
#include "gpureg/registration.hpp"

#include <string>

#include "api/access.hpp"
#include "api/batch.hpp"
#include "api/engine_rows.hpp"
#include "api/name_cloud.hpp"
#include "api/pair_input.hpp"
#include "api/raw_cloud.hpp"
#include "api/with_settings.hpp"
#include "common/limits.hpp"
#include "common/validate.hpp"
#include "gpureg/voxel_size.hpp"

namespace gpureg {
namespace {

/// @param name of the field in error messages.
void check_prior(const RegistrationPrior& prior, const std::string& name,
                 const PreparedState& source, const PreparedState& target,
                 const RegistrationSettings& options) {
  prior.validate(name);
  if (prior.gravity || prior.pose)
    require(options.method == RegistrationMethod::compatibility, "method",
            to_string(options.method), "compatibility: only it can use priors");
  if (!prior.correspondences) return check_features(source, target);
  const std::vector<Correspondence>& given = *prior.correspondences;
  require(given.size() <= limits::kMaxPoints, (name + ".correspondences.size").c_str(),
          given.size(), "at most 2^31 - 1");
  for (std::size_t k = 0; k < given.size(); ++k)
    if (given[k].source >= source.size || given[k].target >= target.size)
      throw InvalidArgument(name + ".correspondences[" + std::to_string(k) + "] is (" +
                            std::to_string(given[k].source) + ", " +
                            std::to_string(given[k].target) + "), but the clouds have " +
                            std::to_string(source.size) + " and " + std::to_string(target.size) +
                            " points");
}

/// @param several names the priors by their numbers.
std::vector<RegistrationResult> align_all_pairs(
    const Context& context, const std::vector<PreparedCloud>& clouds,
    const std::vector<Pair>& pairs, const RegistrationSettings& options,
    const BatchCallbacks& callbacks, const std::vector<RegistrationPrior>& priors, bool several) {
  options.validate();
  if (!priors.empty() && priors.size() != pairs.size())
    throw InvalidArgument("priors has " + std::to_string(priors.size()) +
                          " entries, but pairs has " + std::to_string(pairs.size()));
  check_pairs(context, clouds, pairs, options);
  const RegistrationPrior nothing;
  for (std::size_t p = 0; p < pairs.size(); ++p)
    check_prior(priors.empty() ? nothing : priors[p],
                several ? "priors[" + std::to_string(p) + "]" : "prior",
                *Access::state(clouds[pairs[p].source]), *Access::state(clouds[pairs[p].target]),
                options);
  const std::vector<PairVariant> variants = variants_of(clouds, pairs, options);
  Batch batch(*Access::engine(context), variants, priors, options, callbacks, pairs.size());
  return batch.run();
}

/// @param scales of copies of one cloud that are for matches alone, or none.
std::vector<PreparedCloud> prepare_all(const Context& context,
                                       const std::vector<PointCloudView>& clouds,
                                       const PrepareSettings& options,
                                       const std::vector<std::string>& names,
                                       const std::vector<double>& scales) {
  options.validate();
  check_names(names, clouds.size());
  Engine& engine = *Access::engine(context);
  const auto naming = [&](std::size_t k, const auto& action) {
    return naming_cloud(names, clouds.size(), k, action);
  };
  std::vector<RawCloud> raw(clouds.size());
  std::vector<FrameOrigin> frame_origins(clouds.size());
  std::vector<CloudKnowledge> knowledge;
  for (std::size_t k = 0; k < clouds.size(); ++k) {
    naming(k, [&] { engine.check_on_host(raw[k] = raw_cloud(clouds[k])); });
    raw[k].matched_only = !scales.empty();
    knowledge.push_back(knowledge_of(clouds[k]));
    view_from_frame_origin(clouds[k].origin, frame_origins[k], raw[k]);
  }
  const auto rows = replace_rows(engine, options, naming, knowledge, raw);
  UnknownViewpoints sides(engine, span_of(raw), knowledge, options, scales);
  auto states = prepare_named(names, raw.size(), [&](std::size_t begin, std::size_t end) {
    return sides.prepare(begin, end);
  });
  for (std::size_t k = 0; k < states.size(); ++k) {
    set_frame_offset(clouds[k].origin, *states[k]);
    rows[k]->describe(*states[k]);
    naming(k, [&] { check_viewpoints(knowledge[k], *states[k]); });
  }
  sides.resolve(states);
  return Access::clouds(std::move(states));
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
                         const PreparedCloud& target, const RegistrationSettings& options,
                         const RegistrationPrior& prior) {
  return align_all_pairs(context, {source, target}, {{0, 1}}, options, {}, {prior}, false).front();
}

RegistrationResult align(const Context& context, const PreparedCloud& source,
                         const PreparedCloud& target, const RegistrationOptions& options,
                         const RegistrationPrior& prior) {
  return align(context, source, target, resolve(options), prior);
}

RegistrationResult align(const Context& context, const PointCloudView& source,
                         const PointCloudView& target, const RegistrationSettings& settings,
                         const RegistrationPrior& prior) {
  const std::vector<PreparedCloud> clouds =
      prepare_batch(context, {source, target}, settings.prepare, {"source", "target"});
  return align(context, clouds[0], clouds[1], settings, prior);
}

RegistrationResult align(const Context& context, const PointCloudView& source,
                         const PointCloudView& target, const RegistrationOptions& options,
                         const RegistrationPrior& prior) {
  return align(context, source, target, resolve(options), prior);
}

RegistrationResult align(const Context& context, const PointCloudView& source,
                         const PointCloudView& target) {
  RegistrationOptions options;
  for (std::size_t k = 0; k < 2; ++k)
    naming_cloud({"source", "target"}, 2, k, [&] { (k == 0 ? source : target).validate(); });
  // Without a suggestion there is nothing to align, in voxels of any size.
  const VoxelSizeSuggestion suggestion = suggest_voxel_size({source, target});
  if (suggestion.valid()) options.voxel_size = suggestion.voxel_size;
  return align(context, source, target, options);
}

std::vector<RegistrationResult> align_batch(const Context& context,
                                            const std::vector<PreparedCloud>& clouds,
                                            const std::vector<Pair>& pairs,
                                            const RegistrationSettings& options,
                                            const BatchCallbacks& callbacks,
                                            const std::vector<RegistrationPrior>& priors) {
  return align_all_pairs(context, clouds, pairs, options, callbacks, priors, true);
}

std::vector<RegistrationResult> align_batch(const Context& context,
                                            const std::vector<PreparedCloud>& clouds,
                                            const std::vector<Pair>& pairs,
                                            const RegistrationOptions& options,
                                            const BatchCallbacks& callbacks,
                                            const std::vector<RegistrationPrior>& priors) {
  return align_batch(context, clouds, pairs, resolve(options), callbacks, priors);
}

}  // namespace gpureg
