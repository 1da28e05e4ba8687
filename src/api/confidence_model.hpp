// SPDX-License-Identifier: BSD-3-Clause
// Written by bench/accuracy/fit_confidence.py; docs/accuracy.md says how well it does.
#pragma once

namespace gpureg::confidence_model {

constexpr double ranking_with_free_space_bias = -17.3282662;
constexpr double ranking_with_free_space[] = {0.901474878, 1.05048695, -0.346892787, -0.351392987, -0.353815225, 1.05035826, -0.285163749, 0.0645918246, -0.593751722, 0.539182445, -0.297799277, -13.2183245, 1.80729206, -6.36824582, -0.483228265, -0.874289238, -1.49164973};

constexpr double confidence_with_free_space_bias = -12.9646669;
constexpr double confidence_with_free_space[] = {0.440587195, 0.680222415, -0.0635700391, -0.529326948, -0.793186859, 0.344288986, -0.0313945231, 0.171255332, 0.384640191, 0.0842947783, 2.23899175, -207.845551, -11.983282, -92.6724153, -0.147535457, -0.41702515, -0.343497138, 0.258594272, 0.311910815};

constexpr double overlap_with_free_space_bias = -12.980314;
constexpr double overlap_with_free_space[] = {-0.060195765, 0.871932735, -3.3104188, 3.33421126, 2.25809794, 0.0863430933, -0.411645288, 0.234663424, 5.1918069, 1.07544923, -34.3521258, -241.476889, -1.9637572, -91.1220704, 0.282094431, -0.965504692, -0.316439408, 0.17353451, 0.107445513};

constexpr double ranking_without_free_space_bias = -20.1765899;
constexpr double ranking_without_free_space[] = {-0.0811838789, 2.83562304, 2.08853477, 1.18313861, -3.93109386, 0.342751311, -0.0479454978, 0.0350592777};

constexpr double confidence_without_free_space_bias = -14.5483337;
constexpr double confidence_without_free_space[] = {0.0530805123, 1.65335641, -0.919108933, -0.337318248, -0.203397321, 0.166839197, 0.290444704, 0.0266459705, 0.449429825, 0.599505216};

constexpr double overlap_without_free_space_bias = -17.9164114;
constexpr double overlap_without_free_space[] = {0.726851831, 2.18994125, -2.72467905, 2.43594843, 1.11193806, 0.0334076002, -0.0902459812, 0.220793785, 0.10492275, 0.12288052};

}  // namespace gpureg::confidence_model
