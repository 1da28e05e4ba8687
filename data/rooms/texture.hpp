// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>
#include <cstdint>

#include "data/mesh.hpp"

namespace gpureg::synthetic {

/// Smooth noise in [0, 1] with a feature size of 1: four octaves of hashed values on a lattice.
float fractal_noise(const Eigen::Vector3f& p, std::uint64_t key);

/// Colour (linear RGB, 0 .. 1) of a material at a world point with this normal. Solid textures: no
/// parametrisation is needed.
Eigen::Vector3f surface_colour(const Material& material, const Eigen::Vector3f& point,
                               const Eigen::Vector3f& normal, std::uint64_t key);

}  // namespace gpureg::synthetic
