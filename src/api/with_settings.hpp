// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "gpureg/verification.hpp"
#include "settings/resolve.hpp"

/// The functions of registration.hpp and verification.hpp with settings instead of options: for
/// searches that change what users do not, and for tests.
namespace gpureg {

PreparedCloud prepare(const Context& context, const PointCloudView& cloud,
                      const PrepareSettings& settings);
std::vector<PreparedCloud> prepare_batch(const Context& context,
                                         const std::vector<PointCloudView>& clouds,
                                         const PrepareSettings& settings,
                                         const std::vector<std::string>& names = {});
/// Prepares copies of one cloud, multiplied by scales, for Engine::match() alone: without what
/// poses are verified by. Where nobody gave viewpoints, one copy decides about the sides of all.
std::vector<PreparedCloud> prepare_copies(const Context& context,
                                          const std::vector<PointCloudView>& copies,
                                          const std::vector<double>& scales,
                                          const PrepareSettings& settings);
RegistrationResult align(const Context& context, const PreparedCloud& source,
                         const PreparedCloud& target, const RegistrationSettings& settings,
                         const RegistrationPrior& prior = {});
RegistrationResult align(const Context& context, const PointCloudView& source,
                         const PointCloudView& target, const RegistrationSettings& settings,
                         const RegistrationPrior& prior = {});
std::vector<RegistrationResult> align_batch(const Context& context,
                                            const std::vector<PreparedCloud>& clouds,
                                            const std::vector<Pair>& pairs,
                                            const RegistrationSettings& settings,
                                            const BatchCallbacks& callbacks = {},
                                            const std::vector<RegistrationPrior>& priors = {});
std::vector<PoseVerification> verify_poses(const Context& context, const PreparedCloud& source,
                                           const PreparedCloud& target,
                                           const std::vector<UnalignedIsometry3d>& poses,
                                           const RegistrationSettings& settings,
                                           const VerificationOptions& verification = {});
std::vector<std::vector<PoseVerification>> verify_poses_batch(
    const Context& context, const std::vector<PreparedCloud>& clouds,
    const std::vector<Pair>& pairs, const std::vector<std::vector<UnalignedIsometry3d>>& poses,
    const RegistrationSettings& settings, const VerificationOptions& verification = {});

}  // namespace gpureg
