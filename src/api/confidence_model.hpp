// SPDX-License-Identifier: BSD-3-Clause
// Written by bench/accuracy/fit_confidence.py; docs/accuracy.md says how well it does.
#pragma once

namespace gpureg::confidence_model {

constexpr double ranking_with_free_space_bias = -14.6769742;
constexpr double ranking_with_free_space[] = {1.19746999, 0.623972949, -0.583605598, -0.312965817, -0.334113667, 1.01862495, -0.353923271, 0.0959880557, 0.37367466, 0.636575815, -2.06995707, -23.9023467, -1.23891873, -13.6753439, -0.188831497, -2.06610307, -1.62862605};

constexpr double confidence_with_free_space_bias = -12.5237096;
constexpr double confidence_with_free_space[] = {0.591987271, 0.682188267, 0.00152679473, -0.795108721, -0.746793217, 0.365912865, -0.0460751142, 0.152309014, 0.853254716, 0.442623863, -3.40527549, -172.256533, -10.1270019, -69.8568013, -0.415720389, -1.39543716, -0.172147185, 0.255270539, 0.316834786};

constexpr double overlap_with_free_space_bias = -11.3204238;
constexpr double overlap_with_free_space[] = {0.292713708, 0.631054539, -3.15950395, 2.8209766, 1.97955482, 0.0598943422, -0.426489315, 0.222346235, 6.33726985, 1.2666906, -33.4956286, -193.511208, -2.35195923, -65.5112671, 0.0601803634, -1.4785209, -0.180843131, 0.203433922, 0.106817485};

constexpr double ranking_without_free_space_bias = -16.2953344;
constexpr double ranking_without_free_space[] = {0.148767929, 2.50658566, 2.03121778, 1.30438208, -3.69303217, 0.373557687, -0.00734790317, 0.00258870263};

constexpr double confidence_without_free_space_bias = -16.6984739;
constexpr double confidence_without_free_space[] = {-0.0692033414, 1.85660987, -1.01542498, -0.440742758, -0.201148716, 0.128511237, 0.263231038, 0.0410820425, 0.429766253, 0.617472867};

constexpr double overlap_without_free_space_bias = -17.495114;
constexpr double overlap_without_free_space[] = {0.744236831, 2.2551448, -2.7271863, 2.3631309, 1.12357864, 0.0690943474, -0.0143732712, 0.186714859, 0.102654939, 0.0920697701};

}  // namespace gpureg::confidence_model
