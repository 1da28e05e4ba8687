// SPDX-License-Identifier: BSD-3-Clause
// Written by bench/find/fit.py: 48 scenes of 13 kinds of parts, 4061 poses.
#pragma once

#include <iterator>

#include "localization/find/part_confidence.hpp"

namespace gpureg::localization {

/// What a feature adds on its way from one value to another one, as in confidence/regression.hpp.
struct PartStep {
  PartFeature feature;
  double from, to, rise;
};

struct PartModel {
  double bias;
  const PartStep* steps;
  std::size_t size;
};

constexpr PartStep kInViewSteps[] = {
    {PartFeature::supported, 0.317928436, 0.625864135, 0.182529632},
    {PartFeature::supported, 0.625864135, 0.886578045, 1.96893308},
    {PartFeature::supported, 0.886578045, 0.962318841, 1.03745099},
    {PartFeature::supported, 0.962318841, 1, 0.223238821},
    {PartFeature::violated, 0, 0.209379845, -0.730223722},
    {PartFeature::contour, 0, 0.368421053, 0.61255021},
    {PartFeature::contour, 0.368421053, 0.765432099, 1.08909394},
    {PartFeature::contour, 0.765432099, 0.910569106, 0.45982028},
    {PartFeature::contour_length, 0, 0.499999981, 0.23312644},
    {PartFeature::contour_length, 0.499999981, 1.12499996, 1.88442057},
    {PartFeature::contour_length, 1.12499996, 2.17824766, 1.48475717},
    {PartFeature::contour_length, 2.17824766, 3.85557111, 0.171615126},
    {PartFeature::log_area, -3.48493334, -2.3059459, 0.0903822965},
    {PartFeature::log_area, -2.3059459, -1.83081125, 0.544909013},
    {PartFeature::log_area, -1.83081125, -1.497226, 0.272791809},
    {PartFeature::log_area, -1.497226, -0.706992662, 0.390078926},
    {PartFeature::residual, 0.134806964, 0.174564991, -0.627704699},
    {PartFeature::residual, 0.174564991, 0.325838551, -1.60650178},
    {PartFeature::residual, 0.325838551, 0.527867367, -0.480857543},
    {PartFeature::log_weakest, -4.32079255, -3.81688396, 1.23232286},
    {PartFeature::log_weakest, -3.81688396, -2.96176989, 0.0951706734},
    {PartFeature::log_third_weakest, -4.76421976, -2.93235766, 0.402529611},
    {PartFeature::log_third_weakest, -2.93235766, -2.55203581, 0.831387906},
    {PartFeature::log_third_weakest, -2.55203581, -2.25969479, 0.586233994},
    {PartFeature::log_third_weakest, -2.25969479, -1.83509159, 0.381806586},
    {PartFeature::log_votes, 0, 0.693147181, 0.595953382},
    {PartFeature::log_votes, 0.693147181, 1.94591015, 0.977349162},
    {PartFeature::log_votes, 1.94591015, 3.33220451, 0.0685001049},
    {PartFeature::rival, 0.636083516, 0.850649241, -0.501269087},
    {PartFeature::rival, 0.850649241, 1.60345883, -0.86264141}};
constexpr PartModel kInView{-8.57935349, kInViewSteps, std::size(kInViewSteps)};

constexpr PartStep kUnseenSteps[] = {
    {PartFeature::supported, 0.403311727, 0.619142572, 0.488180446},
    {PartFeature::supported, 0.619142572, 0.74132948, 0.600731005},
    {PartFeature::supported, 0.871015335, 0.998387097, 0.243120982},
    {PartFeature::log_area, -2.18568822, -1.75868889, 0.21287513},
    {PartFeature::log_area, -1.75868889, -1.41798019, 0.660249373},
    {PartFeature::residual, 0.211728894, 0.331780817, -0.845900113},
    {PartFeature::residual, 0.331780817, 0.497853503, -0.439720913},
    {PartFeature::log_weakest, -4.52664929, -4.06822232, 0.165700666},
    {PartFeature::log_weakest, -4.06822232, -3.61532678, 0.610743556},
    {PartFeature::log_weakest, -3.61532678, -2.94663079, 0.327101831},
    {PartFeature::log_third_weakest, -2.87190744, -2.43425447, 0.648441623},
    {PartFeature::log_third_weakest, -2.43425447, -2.2615673, 1.01430597},
    {PartFeature::log_third_weakest, -2.2615673, -1.97114783, 0.131378127},
    {PartFeature::log_votes, 0, 0.693147181, 1.02002807},
    {PartFeature::log_votes, 0.693147181, 1.79175947, 0.458785833},
    {PartFeature::log_votes, 1.79175947, 2.94443898, 0.365854927},
    {PartFeature::rival, 0.588026047, 0.827973977, -0.421748962},
    {PartFeature::rival, 0.827973977, 0.946661275, -1.09464423}};
constexpr PartModel kUnseen{-5.07910592, kUnseenSteps, std::size(kUnseenSteps)};

}  // namespace gpureg::localization
