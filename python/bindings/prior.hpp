// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "bindings.hpp"
#include "cloud.hpp"
#include "gpureg/prior.hpp"

namespace gpureg::python {

/// A prior in the frames of the prepared clouds, which the package may have moved: see
/// Cloud::origin.
RegistrationPrior in_prepared_frames(RegistrationPrior prior, const Cloud& source,
                                     const Cloud& target);

}  // namespace gpureg::python
