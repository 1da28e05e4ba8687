// SPDX-License-Identifier: BSD-3-Clause
// Written by bench/accuracy/fit_confidence.py; docs/accuracy.md says how well it does.
#pragma once

namespace gpureg::confidence_model {

constexpr double ranking_with_free_space_bias = -7.3149984;
constexpr double ranking_with_free_space[] = {0.467198424, 1.23472562, -0.851450435, 0.751349335, 0.82819074, 1.27418133, -0.394185328, -0.131198492, -1.06977717, 0.014057047, -12.783793, -28.3394695, 2.68989379, -20.0130469, -1.59083723, -1.25867445};

constexpr double confidence_with_free_space_bias = -6.56037982;
constexpr double confidence_with_free_space[] = {0.207093606, 0.847571553, -0.332679365, -0.0150550568, 0.216075334, 0.336411233, -0.0706243263, 0.00527398773, 1.19992072, 0.103395286, -21.8664957, -180.097965, -4.3780316, -100.816822, -0.334270536, -1.9978366, 0.200309188, 0.430702189};

constexpr double overlap_with_free_space_bias = -7.01212485;
constexpr double overlap_with_free_space[] = {0.00883275141, 0.354411478, -1.07502492, 2.36757561, 0.689806099, 0.197963888, -0.0792551064, 0.120590169, 4.85060755, 1.25570288, -44.4893469, -170.952587, -7.88182478, -91.7163604, -0.231713033, -0.914179718, 0.137878849, 0.159917051};

constexpr double ranking_without_free_space_bias = -11.0666546;
constexpr double ranking_without_free_space[] = {-0.0837626475, 2.64514148, 1.51808205, 2.96711144, -2.7314763, 0.591260127, -0.0580748664, -0.133518297};

constexpr double confidence_without_free_space_bias = -3.36456288;
constexpr double confidence_without_free_space[] = {0.985432113, 0.968431544, -0.340153337, -0.170484149, -0.151823416, 0.123008858, 0.353297752, -0.0505696634, 0.222351186, 0.827406882};

constexpr double overlap_without_free_space_bias = -3.72695212;
constexpr double overlap_without_free_space[] = {1.03049985, 0.81031155, -1.0992234, 1.4679289, 0.406101329, 0.0990383086, 0.137299597, 0.0691253593, 0.182915173, 0.41089723};

}  // namespace gpureg::confidence_model
