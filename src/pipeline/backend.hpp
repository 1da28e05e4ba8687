// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "gpureg/context.hpp"
#include "pipeline/engine.hpp"
