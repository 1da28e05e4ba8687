// SPDX-License-Identifier: BSD-3-Clause
// Direction codes, by which scoring on the device skips most points. They are bounds: a code must
// never exclude an agreeing normal. No device needed.
#include <gtest/gtest.h>

#include <random>
#include <vector>

#include "algorithm/inlier.hpp"
#include "cuda/prepare/directions.hpp"

namespace gpureg::cuda {
namespace {

Vec3 random_normal(std::mt19937& random) {
  std::normal_distribution<float> gauss;
  return normalized_or_zero({gauss(random), gauss(random), gauss(random)});
}

Rigid random_rotation(std::mt19937& random) {
  std::normal_distribution<float> gauss;
  const float w = gauss(random), x = gauss(random), y = gauss(random), z = gauss(random),
              n = std::sqrt(w * w + x * x + y * y + z * z);
  return to_rigid(Pose<float>{w / n, x / n, y / n, z / n, 0, 0, 0});
}

/// Normals that stray from a direction by more or less, one in ten unknown.
std::vector<Vec3> random_cell(std::mt19937& random) {
  std::uniform_real_distribution<float> unit;
  const Vec3 mean = random_normal(random);
  const float spread = unit(random) < 0.7f ? 0.4f * unit(random) : 2.0f;
  std::vector<Vec3> normals(1 + random() % 6);
  for (Vec3& n : normals)
    n = unit(random) < 0.1f ? Vec3{0, 0, 0}
                            : normalized_or_zero(mean + random_normal(random) * spread);
  return normals;
}

class CellCodes : public testing::TestWithParam<float> {};

TEST_P(CellCodes, NeverExcludeAgreeingNormals) {
  std::mt19937 random(7);
  const DirectionTables tables = direction_tables();
  const CodeTest test = code_test(GetParam());
  const float min_cosine = inlier_test(1.0f, GetParam()).min_cosine;
  int disagree = 0, denied = 0;
  for (int round = 0; round < 20000; ++round) {
    const std::vector<Vec3> normals = random_cell(random);
    std::vector<std::uint32_t> candidates(normals.size());
    for (std::size_t k = 0; k < candidates.size(); ++k)
      candidates[k] = static_cast<std::uint32_t>(k);
    const std::uint32_t code =
        code_of_cell(tables, {candidates.data(), candidates.size()}, normals.data());
    ASSERT_GE(code, 1u);
    ASSERT_LE(code, kCodeAny);
    const Vec3 normal = round % 10 == 0 ? Vec3{0, 0, 0} : random_normal(random);
    const Rigid rotation = random_rotation(random);
    const std::uint32_t agreeing =
        agreeing_codes(tables, test, rotation, class_of_normal(tables, normal));
    EXPECT_EQ(agreeing & 0xffffu, agreeing >> 16);
    EXPECT_EQ(agreeing & 1u, 0u) << "an empty cell has nobody who agrees";
    bool agrees = false;
    for (const Vec3& n : normals)
      agrees = agrees || normals_agree(rotate(rotation, normal), n, min_cosine);
    const bool passes = (agreeing >> code & 1u) != 0;
    ASSERT_TRUE(passes || !agrees) << "round " << round;
    disagree += !agrees;
    denied += !agrees && !passes;
  }
  // A table of ones would pass all of the above.
  if (GetParam() <= 60.0f) {
    EXPECT_GT(denied, disagree / 10) << disagree;
  } else if (GetParam() >= 180.0f) {
    EXPECT_EQ(disagree, 0);
  }
}
INSTANTIATE_TEST_SUITE_P(Angles, CellCodes, testing::Values(5.0f, 30.0f, 60.0f, 120.0f, 180.0f));

/// Every direction has a class near enough, or the class that agrees with everything.
TEST(CellCodes, ClassesAreNear) {
  std::mt19937 random(8);
  const DirectionTables tables = direction_tables();
  int any = 0;
  for (int k = 0; k < 20000; ++k) {
    const Vec3 n = random_normal(random);
    const std::uint32_t c = class_of_normal(tables, n);
    EXPECT_TRUE(c == kClassAny || dot(tables.classes[c], n) >= tables.class_cosine);
    any += c == kClassAny;
  }
  EXPECT_LT(any, 200) << "classes should cover nearly all directions";
  EXPECT_EQ(class_of_normal(tables, {0, 0, 0}), kClassNone);
}

}  // namespace
}  // namespace gpureg::cuda
