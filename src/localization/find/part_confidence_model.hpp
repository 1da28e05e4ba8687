// SPDX-License-Identifier: BSD-3-Clause
// Written by bench/find/fit.py: 290 scenes of 16 kinds of parts, 5514 poses.
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
    {PartFeature::supported, 0.173156841, 0.631734915, 0.34390196},
    {PartFeature::supported, 0.631734915, 0.821153599, 1.05668074},
    {PartFeature::supported, 0.821153599, 0.922982976, 0.717535719},
    {PartFeature::supported, 0.922982976, 0.991906049, 0.286235843},
    {PartFeature::violated, 0.0110192838, 0.0184295943, -0.568428357},
    {PartFeature::violated, 0.0184295943, 0.0577547318, -0.966845303},
    {PartFeature::violated, 0.0577547318, 0.379530963, -0.263024919},
    {PartFeature::contour, 0, 0.169864125, 0.580578597},
    {PartFeature::contour, 0.169864125, 0.595856513, 1.18095999},
    {PartFeature::contour, 0.595856513, 0.824140842, 0.699722742},
    {PartFeature::contour, 0.824140842, 0.981485119, 0.159313675},
    {PartFeature::contour_length, 0.0251804332, 1.10217821, 0.151467268},
    {PartFeature::contour_length, 1.10217821, 1.64999975, 0.952322595},
    {PartFeature::contour_length, 1.64999975, 2.25204872, 0.760716743},
    {PartFeature::contour_length, 2.25204872, 3.95322357, 0.126087309},
    {PartFeature::log_area, -4.72431876, -2.15388994, 0.236562263},
    {PartFeature::log_area, -2.15388994, -1.74146014, 0.232989022},
    {PartFeature::residual, 0.132746428, 0.16778027, -0.219219731},
    {PartFeature::residual, 0.16778027, 0.231216367, -0.782120049},
    {PartFeature::residual, 0.231216367, 0.508528497, -0.9282244},
    {PartFeature::log_weakest, -5.42734682, -4.1836546, 0.00727426881},
    {PartFeature::log_weakest, -4.1836546, -3.68580355, 0.0822938496},
    {PartFeature::log_weakest, -3.68580355, -2.4742136, 0.0858510948},
    {PartFeature::log_third_weakest, -7.83680909, -2.96712976, 0.212321615},
    {PartFeature::log_third_weakest, -2.96712976, -2.47310027, 0.855455478},
    {PartFeature::log_third_weakest, -2.47310027, -2.22710724, 0.565317798},
    {PartFeature::log_third_weakest, -2.22710724, -1.75627644, 0.275626038},
    {PartFeature::log_votes, 0, 1.09861229, 0.944768748},
    {PartFeature::log_votes, 1.09861229, 2.19722458, 0.867882075},
    {PartFeature::log_votes, 2.19722458, 3.63758616, 0.262133037},
    {PartFeature::rival, 0, 0.309366424, -0.0931646172},
    {PartFeature::rival, 0.309366424, 0.834824475, -0.305327568},
    {PartFeature::rival, 0.834824475, 1.00909455, -0.832567665},
    {PartFeature::rival, 1.00909455, 2.59259259, -0.0201094166}};
constexpr PartModel kInView{-5.29956827, kInViewSteps, std::size(kInViewSteps)};

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
