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

/// The API of gpureg: prepare each cloud once, then align any pairs of them.
namespace gpureg {

/// Prepares a cloud for alignment: downsamples, builds search grids, estimates and orients normals,
/// computes features, draws depth maps from the viewpoints and marks the sides of surfaces. The
/// features are FPFH, optionally also of a second, wide radius, or those of the view. An empty
/// cloud is no error: its alignments report too_few_source_points or too_few_target_points.
/// Thread-safe.
/// @param context backend that prepares and holds the cloud.
/// @param cloud host memory, lengths in metres (or the unit of the options).
/// @param options voxel_size and prepare.
/// @return handle to the prepared cloud.
/// @throws InvalidArgument for options or views out of range, and for points that do not fit the
///   options: a cloud wider than 2^20 voxels or too dense for the radii, or more than 20,000 points
///   of which nearly all are isolated (millimetres with a voxel size in metres).
/// @throws DeviceError if the device fails.
PreparedCloud prepare(const Context& context, const PointCloudView& cloud,
                      const RegistrationOptions& options = {});

/// prepare() for many clouds at once; each result equals that of prepare() alone.
/// @param names names of the clouds in error messages, as many as clouds, or none (clouds[0],
///   clouds[1] ...).
/// @return one handle per cloud, in order.
/// @throws InvalidArgument as prepare() does, naming the cloud.
std::vector<PreparedCloud> prepare_batch(const Context& context,
                                         const std::vector<PointCloudView>& clouds,
                                         const RegistrationOptions& options = {},
                                         const std::vector<std::string>& names = {});

/// Finds target_from_source of two prepared clouds by options.method. Thread-safe.
///
/// RegistrationMethod::compatibility returns the distinct poses in modes: up to evidence.modes
/// refined ones, and perturbed poses of the degeneracy search. RegistrationMethod::quadruples
/// (LoopSmart, Algorithm 1) returns one pose and no modes.
///
/// The same clouds, options and seed give the same poses, evidence and confidences, bit for bit, on
/// every backend, processor and C library and for any number of threads (docs/versioning.md has the
/// conditions).
/// @param source cloud that the pose moves.
/// @param target cloud that stays.
/// @param options options.prepare is validated but not applied; each cloud keeps what it was
///   prepared with.
/// @param prior what is known of the pair; nothing by default.
/// @return the result; "no alignment" is a status, not an error.
/// @throws InvalidArgument if a correspondence distance exceeds that of the preparation, if
///   the dimensions of the features differ, for clouds of another backend, for a prior out of range
///   or with an index out of range, and for a pose or gravity with RegistrationMethod::quadruples.
/// @throws DeviceError if the device fails.
RegistrationResult align(const Context& context, const PreparedCloud& source,
                         const PreparedCloud& target, const RegistrationOptions& options = {},
                         const RegistrationPrior& prior = {});

/// Prepares both clouds and aligns them. Prepare clouds of several pairs once instead.
/// @throws InvalidArgument as prepare() and align() do.
RegistrationResult align(const Context& context, const PointCloudView& source,
                         const PointCloudView& target, const RegistrationOptions& options,
                         const RegistrationPrior& prior = {});

/// The same with the voxel size that suggest_voxel_size() says of both clouds; the result has it.
RegistrationResult align(const Context& context, const PointCloudView& source,
                         const PointCloudView& target);

/// Indices into the clouds of a batch.
struct Pair {
  std::uint32_t source;
  std::uint32_t target;
};

/// Callbacks of align_batch(). Both run on the calling thread, and either may be empty.
struct BatchCallbacks {
  /// Receives each finished pair once, in pair order, in the calling thread: index into pairs,
  /// result. On a device the next chunk of pairs is already under way.
  std::function<void(std::size_t, const RegistrationResult&)> on_result;
  /// Polled before each chunk of pairs. true ends the batch: pairs of chunks that began still get
  /// their results, the remaining ones return RegistrationStatus::skipped.
  std::function<bool()> should_stop;
};

/// Aligns many pairs. Each result equals align() of its pair bit for bit (timings aside), whatever
/// the order or the split of the batch. Thread-safe.
/// @param clouds prepared clouds of the backend of the context.
/// @param pairs indices into clouds.
/// @param callbacks progress and cancellation.
/// @param priors what is known of each pair, as many as pairs, or none.
/// @return one result per pair, by pair index.
/// @throws InvalidArgument as align(), and for an index out of range; all pairs are checked before
///   the first one runs.
/// @throws DeviceError if the device fails.
std::vector<RegistrationResult> align_batch(const Context& context,
                                            const std::vector<PreparedCloud>& clouds,
                                            const std::vector<Pair>& pairs,
                                            const RegistrationOptions& options = {},
                                            const BatchCallbacks& callbacks = {},
                                            const std::vector<RegistrationPrior>& priors = {});

}  // namespace gpureg
