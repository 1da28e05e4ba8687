// SPDX-License-Identifier: BSD-3-Clause
// gpureg_fuzz_io [--seconds S] [--seed N]: mutates the seed files for so long. The same seed gives
// the same inputs in the same order.
#include <chrono>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <exception>
#include <random>
#include <string>

#include "io/mutate.hpp"
#include "io/run_reader.hpp"
#include "io/seed_files.hpp"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size);

int main(int argc, char** argv) {
  double seconds = 10;
  std::uint64_t seed = 1;
  for (int k = 1; k + 1 < argc; k += 2) {
    const std::string option = argv[k];
    if (option == "--seconds") seconds = std::atof(argv[k + 1]);
    if (option == "--seed") seed = std::strtoull(argv[k + 1], nullptr, 10);
  }
  const auto seeds = gpureg::test::seed_files();
  std::mt19937_64 random(seed);
  const auto start = std::chrono::steady_clock::now();
  const auto elapsed = [&] {
    return std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  };
  std::uint64_t inputs = 0;
  std::string input;
  try {
    for (; elapsed() < seconds; ++inputs) {
      const auto& file = seeds[random() % seeds.size()];
      input = static_cast<char>(file.reader) + gpureg::test::mutate(file.content, random);
      LLVMFuzzerTestOneInput(reinterpret_cast<const std::uint8_t*>(input.data()), input.size());
    }
  } catch (const std::exception& error) {
    std::fprintf(stderr, "input %llu of seed %llu: %s\n", static_cast<unsigned long long>(inputs),
                 static_cast<unsigned long long>(seed), error.what());
    return 1;
  }
  std::printf("%llu inputs in %.0f s, no crash\n", static_cast<unsigned long long>(inputs),
              elapsed());
  return 0;
}
