// SPDX-License-Identifier: BSD-3-Clause
#include "options/set_option.hpp"

#include <gtest/gtest.h>

#include "gpureg/error.hpp"
#include "support/expect_error.hpp"

namespace gpureg::cli {
namespace {

TEST(SetOption, EachTypeIsRead) {
  RegistrationOptions o;
  for (const char* text :
       {"evidence.sample=1024", "prepare.voxel_size=0.125", "quadruples.mutual=true",
        "method=quadruples", "seed=18446744073709551615", "calibration.offset=-1e-3"})
    set_option(o, text);
  EXPECT_EQ(o.evidence.sample, 1024u);
  EXPECT_EQ(o.prepare.voxel_size, 0.125f);
  EXPECT_TRUE(o.quadruples.mutual);
  EXPECT_EQ(o.method, RegistrationMethod::quadruples);
  EXPECT_EQ(o.seed, 18446744073709551615u);
  EXPECT_EQ(o.calibration.offset, -1e-3);
  const RegistrationOptions untouched;
  EXPECT_EQ(o.evidence.modes, untouched.evidence.modes);
  EXPECT_EQ(o.prepare.normal_radius, untouched.prepare.normal_radius);
}

TEST(SetOption, WhatDoesNotFitIsNamed) {
  const auto refuse = [](const char* text, const char* why) {
    RegistrationOptions o;
    test::expect_error<InvalidArgument>([&] { set_option(o, text); },
                                        {std::string("--set ") + text + ": " + why});
  };
  refuse("evidence.sample", "expected NAME=VALUE");
  refuse("evidence.sampel=3", "there is no such option (did you mean sample?), only sample, modes");
  refuse("evidence=3", "there is no such option, only sample, modes");
  refuse("seed.x=3", "there is no such option (did you mean seed?), only seed, min_confidence");
  refuse("=3", "there is no such option");
  refuse("evidence.sample=-1", "expected a whole number from 0 to 4294967295");
  refuse("evidence.sample=4294967296", "expected a whole number from 0 to 4294967295");
  refuse("evidence.sample=", "expected a whole number");
  refuse("prepare.voxel_size=5cm", "expected a number");
  refuse("prepare.voxel_size=", "expected a number");
  refuse("quadruples.mutual=1", "expected true or false");
  refuse("method=luck", "expected compatibility or quadruples");
}

}  // namespace
}  // namespace gpureg::cli
