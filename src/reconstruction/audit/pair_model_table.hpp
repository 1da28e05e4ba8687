// SPDX-License-Identifier: BSD-3-Clause
// Written by bench/accuracy/fit_audit.py.
#pragma once

#include <cstddef>
#include <cstdint>

namespace gpureg::reconstruction {

enum class PairFeature : std::uint8_t { coincide, doubt, no_violation, none_violating };
constexpr std::size_t kPairFeatures = 4;

/// What a feature adds on its way from one value to another one.
struct PairStep {
  PairFeature feature;
  double from, to, rise;
};

constexpr PairStep kPairSteps[] = {
    {PairFeature::coincide, 0, 1, 0.844},           {PairFeature::coincide, 1, 2, 0.378},
    {PairFeature::coincide, 2, 4, 0.077},           {PairFeature::doubt, -9, -5, 0.00677},
    {PairFeature::doubt, -5, -3, 0.0598},           {PairFeature::doubt, -3, -1.5, 0.152},
    {PairFeature::doubt, -1.5, 0, 0.821},           {PairFeature::no_violation, 0.6, 1.6, 0.165},
    {PairFeature::no_violation, 1.6, 2.6, 0.315},   {PairFeature::no_violation, 2.6, 3.5, 0.545},
    {PairFeature::no_violation, 3.5, 4.5, 0.525},   {PairFeature::no_violation, 4.5, 5.8, 0.502},
    {PairFeature::none_violating, 2.3, 3.5, 0.143}, {PairFeature::none_violating, 3.5, 4.5, 0.448},
    {PairFeature::none_violating, 4.5, 5.7, 0.634}, {PairFeature::none_violating, 5.7, 6.9, 0.526}};
constexpr double kPairBias = -4.8898;

}  // namespace gpureg::reconstruction
