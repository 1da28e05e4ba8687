// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "localization/place_confidence.hpp"

// Written by bench/localization/fit_places.py.
namespace gpureg::localization {

/// Weights in the order of PlaceFeature.
struct PlaceRegression {
  std::array<double, kPlaceFeatures> weights;
  double bias;
};

struct PlaceModel {
  PlaceRegression own;    ///< of a place alone: what rivals are measured by
  PlaceRegression among;  ///< of a place in view of the others
};

constexpr PlaceModel kPlanned{
    {{0.1358, 0.6142, 0.6182, 0.6827, 0.7486, 0.5074, 1.403, 0.04445, 0.6991, 0, 0, 0}, -23.55},
    {{0.3551, 0.512, 0.4337, 0.1916, 0.514, 0.4556, 1.064, 0.02117, 0.1541, 0, 0, 0.5491}, -19.73}};
constexpr PlaceModel kOfTiles{
    {{0.7669, 0, 0, 0.2014, 0.3749, 0.0691, 1.006, 0, 0.6863, 0.5388, 0.1009, 0}, -9.774},
    {{0.7118, 0, 0, 0.1588, 0.3606, 0.07855, 0.9676, 0, 0.5847, 0.4863, 0.1903, 0.09932}, -10.17}};

}  // namespace gpureg::localization
