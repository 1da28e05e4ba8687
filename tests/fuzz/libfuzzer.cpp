// SPDX-License-Identifier: BSD-3-Clause
// gpureg_fuzz --target=NAME [options of libFuzzer] CORPUS...; --list prints the names.
#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <string>

#include "fuzz/targets.hpp"

namespace {

const gpureg::fuzz::Target* target_named(const std::string& name) {
  static const std::vector<gpureg::fuzz::Target> targets = gpureg::fuzz::all_targets();
  for (const auto& target : targets)
    if (name == target.name) return &target;
  return nullptr;
}

const gpureg::fuzz::Target* chosen = nullptr;

}  // namespace

// An allocation beyond the size of any input here means that a reader allocated by the count in a
// header.
extern "C" const char* __asan_default_options();
extern "C" const char* __asan_default_options() { return "max_allocation_size_mb=512"; }

extern "C" int LLVMFuzzerInitialize(int* count, char*** arguments);
extern "C" int LLVMFuzzerInitialize(int* count, char*** arguments) {
  const std::string option = "--target=";
  for (int k = 1; k < *count; ++k) {
    const std::string argument = (*arguments)[k];
    if (argument.rfind(option, 0) == 0) chosen = target_named(argument.substr(option.size()));
    if (argument == "--list") {
      for (const auto& target : gpureg::fuzz::all_targets()) std::printf("%s\n", target.name);
      std::exit(0);
    }
  }
  if (chosen == nullptr) {
    std::fprintf(stderr, "error: --target=NAME with a name of --list\n");
    std::exit(2);
  }
  return 0;
}

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size);
extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  chosen->run({reinterpret_cast<const char*>(data), size});
  return 0;
}
