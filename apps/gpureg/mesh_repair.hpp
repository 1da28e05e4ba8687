// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "mesh.hpp"

namespace gpureg::cli {

/// Drops faces without area, turns faces that are wound against their neighbours, counts edges, and
/// turns closed meshes outwards.
void repair_mesh(SurfaceMesh& mesh);

}  // namespace gpureg::cli
