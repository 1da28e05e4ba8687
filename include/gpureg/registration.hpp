// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include "gpureg/context.hpp"
#include "gpureg/error.hpp"
#include "gpureg/options.hpp"
#include "gpureg/point_cloud.hpp"
#include "gpureg/prepared_cloud.hpp"
#include "gpureg/prior.hpp"
#include "gpureg/result.hpp"

/// The door of gpureg: prepare each cloud once, align any pairs of them.
namespace gpureg {

/// Downsamples, estimates and orients normals, computes features (FPFH of one or two radii, or
/// takes the view's own), builds the search grid and draws depth maps from the viewpoints. Never
/// fails for the data itself: an empty cloud gives an empty PreparedCloud, whose alignments say
/// too_few_source_points (or target). Throws InvalidArgument for bad options or views, and for
/// clouds wider than 2^20 voxels, too dense for the radii, or of more than 20,000 points nearly all
/// of which are alone (millimetres, and a voxel in metres). Thread-safe.
PreparedCloud prepare(const Context& context, const PointCloudView& cloud,
                      const PrepareOptions& options = {});

/// prepare() for many clouds at once, each with the same result as alone. names: what errors call
/// the clouds, files perhaps; without, clouds[0], clouds[1] ...
std::vector<PreparedCloud> prepare_batch(const Context& context,
                                         const std::vector<PointCloudView>& clouds,
                                         const PrepareOptions& options = {},
                                         const std::vector<std::string>& names = {});

/// Finds target_from_source of two prepared clouds, by options.method: from compatible
/// matches, judged by evidence (then modes holds every distinct pose), or by LoopSmart's
/// Algorithm 1. Deterministic in clouds, options and seed. options.prepare is checked, but not
/// used: what a cloud was prepared with counts. Throws InvalidArgument where a cloud's
/// search_distance is less than the correspondence distances, and where the clouds' features differ
/// in dimension. Thread-safe.
RegistrationResult align(const Context& context, const PreparedCloud& source,
                         const PreparedCloud& target, const RegistrationOptions& options = {});

/// The same with what is known of the pose beforehand. Throws InvalidArgument for a bad prior, and
/// for one that is not empty with RegistrationMethod::quadruples, which cannot use it.
RegistrationResult align(const Context& context, const PreparedCloud& source,
                         const PreparedCloud& target, const RegistrationPrior& prior,
                         const RegistrationOptions& options = {});

/// The easy door: prepares both clouds and aligns them.
RegistrationResult align(const Context& context, const PointCloudView& source,
                         const PointCloudView& target, const RegistrationOptions& options = {});

/// Indices of a source and a target point (of PreparedCloud::points()) that are believed to be the
/// same place.
struct Correspondence {
  std::uint32_t source;
  std::uint32_t target;
};

/// align() on correspondences of your own instead of feature matches. Throws InvalidArgument for an
/// index out of range.
RegistrationResult align(const Context& context, const PreparedCloud& source,
                         const PreparedCloud& target,
                         const std::vector<Correspondence>& correspondences,
                         const RegistrationOptions& options = {});

/// Indices into the clouds of a batch.
struct Pair {
  std::uint32_t source;
  std::uint32_t target;
};

/// What a caller of align_batch may hook into. Both run on the calling thread.
struct BatchCallbacks {
  /// Called once per finished pair, in pair order: index into pairs, and its result.
  std::function<void(std::size_t, const RegistrationResult&)> on_result;
  /// Asked between chunks of pairs; true ends the batch: the pairs left over come back as
  /// RegistrationStatus::skipped.
  std::function<bool()> should_stop;
};

/// Aligns many pairs; results by pair index. Each result equals align() of its pair bit for bit,
/// whatever the order or the split (timings aside). Throws InvalidArgument for a pair index out of
/// range or clouds of another backend.
std::vector<RegistrationResult> align_batch(const Context& context,
                                            const std::vector<PreparedCloud>& clouds,
                                            const std::vector<Pair>& pairs,
                                            const RegistrationOptions& options = {},
                                            const BatchCallbacks& callbacks = {});

/// The same with a prior for each pair: as many as pairs, or none. Throws as align() with a prior
/// does, naming the pair.
std::vector<RegistrationResult> align_batch(const Context& context,
                                            const std::vector<PreparedCloud>& clouds,
                                            const std::vector<Pair>& pairs,
                                            const std::vector<RegistrationPrior>& priors,
                                            const RegistrationOptions& options = {},
                                            const BatchCallbacks& callbacks = {});

}  // namespace gpureg
