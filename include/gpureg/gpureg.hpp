// SPDX-License-Identifier: BSD-3-Clause
#pragma once

/// Everything in gpureg's core. Optional components have headers of their own: io.hpp, pcl.hpp,
/// evaluation.hpp.
#include "gpureg/registration.hpp"
