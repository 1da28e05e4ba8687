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
       {"prepare.depth_maps=4", "voxel_size=0.125", "prepare.downsample=false", "method=quadruples",
        "seed=18446744073709551615", "calibration.offset=-1e-3", "tune=evidence.sample=1024"})
    set_option(o, text);
  EXPECT_EQ(o.prepare.depth_maps, 4u);
  EXPECT_EQ(o.voxel_size, 0.125f);
  EXPECT_FALSE(o.prepare.downsample);
  EXPECT_EQ(o.method, RegistrationMethod::quadruples);
  EXPECT_EQ(o.seed, 18446744073709551615u);
  EXPECT_EQ(o.calibration.offset, -1e-3);
  EXPECT_EQ(o.tune, "evidence.sample=1024");
  const RegistrationOptions untouched;
  EXPECT_EQ(o.prepare.normal_radius, untouched.prepare.normal_radius);
}

TEST(SetOption, WhatDoesNotFitIsNamed) {
  const auto refuse = [](const char* text, const char* why) {
    RegistrationOptions o;
    test::expect_error<InvalidArgument>([&] { set_option(o, text); },
                                        {std::string("--set ") + text + ": " + why});
  };
  refuse("prepare.depth_maps", "expected NAME=VALUE");
  refuse("prepare.depth_map=3",
         "there is no such option (did you mean depth_maps?), only downsample, normal_radius");
  refuse("prepare=3", "there is no such option, only downsample, normal_radius");
  refuse("seed.x=3", "there is no such option (did you mean seed?), only voxel_size, quality");
  refuse("=3", "there is no such option");
  refuse("prepare.depth_maps=-1", "expected a whole number from 0 to 4294967295");
  refuse("prepare.depth_maps=4294967296", "expected a whole number from 0 to 4294967295");
  refuse("prepare.depth_maps=", "expected a whole number");
  refuse("voxel_size=5cm", "expected a number");
  refuse("voxel_size=", "expected a number");
  refuse("prepare.downsample=1", "expected true or false");
  refuse("method=luck", "expected compatibility or quadruples");
}

}  // namespace
}  // namespace gpureg::cli
