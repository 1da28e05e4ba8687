// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "settings/settings.hpp"

namespace gpureg {

/// The settings of options: lengths in the unit of the points, internal constants.
/// @throws InvalidArgument naming field and value.
RegistrationSettings resolve(const RegistrationOptions& options);
PrepareSettings resolve(const PrepareOptions& options, float voxel_size);

}  // namespace gpureg
