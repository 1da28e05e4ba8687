// SPDX-License-Identifier: BSD-3-Clause
// Written by bench/accuracy/fit_confidence.py; docs/accuracy.md says how well it does.
#pragma once

namespace gpureg::confidence_model {

constexpr double ranking_with_free_space_bias = -16.9442628;
constexpr double ranking_with_free_space[] = {0.857414267, 1.06092767, -0.641357509, -0.196819283, -0.489970988, 1.07396983, -0.362896741, 0.0740892581, 1.72565471, 0.502745036, -6.07241117, -26.1981379, -2.90046609, -16.5153618, -0.123287779, -1.36095285, -1.58475129};

constexpr double confidence_with_free_space_bias = -11.1293435;
constexpr double confidence_with_free_space[] = {0.556819453, 0.567395043, 0.0653836021, -0.419042619, -0.971145035, 0.38360171, 0.0197224536, 0.153781791, 0.420590246, 0.0392692789, 3.80582136, -197.636825, -14.4320421, -121.215405, -0.10725653, -0.460128322, -0.359278129, 0.287471323, 0.297854008};

constexpr double overlap_with_free_space_bias = -12.7016047;
constexpr double overlap_with_free_space[] = {-0.0348113141, 0.777097404, -3.31343138, 3.23515121, 1.98335987, -0.0166335424, -0.360536529, 0.248502457, 5.52353658, 1.31883458, -41.3075832, -244.250836, -3.37275369, -90.2986204, 0.313673575, -1.54419106, -0.237776434, 0.219018462, 0.118825975};

constexpr double ranking_without_free_space_bias = -21.2324122;
constexpr double ranking_without_free_space[] = {-0.203190398, 3.02512766, 1.9729441, 1.38594669, -4.27247654, 0.364292201, -0.100441276, 0.0526380936};

constexpr double confidence_without_free_space_bias = -13.1393923;
constexpr double confidence_without_free_space[] = {0.187462692, 1.61742158, -0.939719659, -0.295553438, -0.225572176, 0.12101344, 0.351818004, 0.0205070705, 0.442585264, 0.553146324};

constexpr double overlap_without_free_space_bias = -15.8795158;
constexpr double overlap_without_free_space[] = {0.749234317, 2.03661058, -2.67568367, 2.3474529, 1.12704408, 0.0145824787, -0.0552629521, 0.212938174, 0.149876913, 0.0886250631};

}  // namespace gpureg::confidence_model
