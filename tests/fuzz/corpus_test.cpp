// SPDX-License-Identifier: BSD-3-Clause
// Every input of the corpora, findings of earlier runs among them, with any compiler.
#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <random>

#include "files/text_file.hpp"
#include "fuzz/targets.hpp"
#include "io/mutate.hpp"

namespace gpureg::fuzz {
namespace {

namespace fs = std::filesystem;

std::vector<fs::path> inputs_of(const std::string& target) {
  std::vector<fs::path> out;
  const fs::path folder = fs::path(GPUREG_FUZZ_CORPUS) / target;
  if (fs::exists(folder))
    for (const auto& entry : fs::directory_iterator(folder)) out.push_back(entry.path());
  std::sort(out.begin(), out.end());
  return out;
}

class Corpus : public ::testing::TestWithParam<Target> {};

TEST_P(Corpus, IsReadOrRefused) {
  const std::vector<fs::path> inputs = inputs_of(GetParam().name);
  ASSERT_FALSE(inputs.empty()) << "no corpus for the target " << GetParam().name;
  for (const fs::path& input : inputs) {
    SCOPED_TRACE(input);
    EXPECT_NO_THROW(GetParam().run(files::read_file(input.string())));
  }
}

TEST_P(Corpus, AFewHundredMutationsAreReadOrRefused) {
  std::mt19937_64 random(3);
  for (const fs::path& input : inputs_of(GetParam().name))
    for (int k = 0; k < 40; ++k) {
      const std::string bytes = test::mutate(files::read_file(input.string()), random);
      SCOPED_TRACE(input.string() + ", mutation " + std::to_string(k));
      EXPECT_NO_THROW(GetParam().run(bytes));
    }
}

INSTANTIATE_TEST_SUITE_P(Fuzz, Corpus, ::testing::ValuesIn(all_targets()),
                         [](const auto& target) { return std::string(target.param.name); });

}  // namespace
}  // namespace gpureg::fuzz
