// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <random>

#include "io/mutate.hpp"
#include "io/run_reader.hpp"
#include "io/seed_files.hpp"

namespace gpureg::test {
namespace {

TEST(Mutation, EverySeedFileIsSound) {
  for (const SeedFile& seed : seed_files())
    EXPECT_TRUE(run_reader(seed.reader, seed.content)) << seed.content;
}

TEST(Mutation, EveryPrefixIsReadOrRefused) {
  for (const SeedFile& seed : seed_files())
    for (std::size_t size = 0; size < seed.content.size(); ++size)
      EXPECT_NO_THROW(run_reader(seed.reader, seed.content.substr(0, size)));
}

// A short run of what the fuzzer does for a minute. Whatever the bytes: a cloud or an IoError that
// names the file.
TEST(Mutation, AnyBytesAreReadOrRefused) {
  const auto seeds = seed_files();
  std::mt19937_64 random(20);
  int read = 0, refused = 0;
  for (int k = 0; k < 20000; ++k) {
    const SeedFile& seed = seeds[random() % seeds.size()];
    const std::string content = mutate(seed.content, random);
    ASSERT_NO_THROW((run_reader(seed.reader, content) ? read : refused) += 1)
        << "mutation " << k << " of " << seed.content;
  }
  EXPECT_GT(read, 100);  // mutations that break everything would test nothing but the first check
  EXPECT_GT(refused, 100);
}

}  // namespace
}  // namespace gpureg::test
