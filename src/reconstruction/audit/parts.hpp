// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <vector>

#include "gpureg/reconstruction/audit.hpp"

namespace gpureg::reconstruction {

/// The part of each scan; kNoPart where it has no pose.
using Parts = std::vector<std::uint32_t>;
constexpr std::uint32_t kNoPart = 0xffffffffu;

/// Scans whose poses are right to each other as far as pairs say. Support across a contradicted
/// connection counts for nothing: what stands between the parts may look alike.
Parts parts_of(const std::vector<UnalignedIsometry3d>& poses, const Audit& found);

/// Where the map is sound without a few scans, and hangs together as before, they alone are wrong:
/// each is a part of its own, and the others are one. Empty: it is not so.
Parts parts_without_few(const Context& context, const std::vector<PreparedCloud>& clouds,
                        const std::vector<UnalignedIsometry3d>& poses, const Audit& found,
                        const RegistrationOptions& registration, const AuditOptions& options);

}  // namespace gpureg::reconstruction
