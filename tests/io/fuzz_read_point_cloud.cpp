// SPDX-License-Identifier: BSD-3-Clause
// Entry point of libFuzzer, and of the loop in fuzz_loop.cpp: the first byte picks the reader, the
// rest is the file.
#include <cstddef>
#include <cstdint>

#include "io/run_reader.hpp"

// An allocation beyond the size of any input here means that a reader allocated by the count in a
// header.
extern "C" const char* __asan_default_options();
extern "C" const char* __asan_default_options() { return "max_allocation_size_mb=256"; }

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size);
extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  if (size == 0) return 0;
  const auto reader = static_cast<gpureg::test::Reader>(data[0] % gpureg::test::kReaders);
  gpureg::test::run_reader(reader, {reinterpret_cast<const char*>(data + 1), size - 1});
  return 0;
}
