// SPDX-License-Identifier: BSD-3-Clause
#include "verbs/generate.hpp"

#include <unistd.h>

#include <filesystem>

#include "gpureg/error.hpp"

namespace gpureg::cli {
namespace {

// The folder of the command, where the generator lies too.
std::filesystem::path own_folder(const char* own_name) {
  std::error_code error;  // no /proc: the name it was called by
  const auto own = std::filesystem::read_symlink("/proc/self/exe", error);
  return (error ? std::filesystem::path(own_name) : own).parent_path();
}

}  // namespace

void become_generator(char** argv) {
  const std::string program = own_folder(argv[0]) / "gpureg-generate";
  argv[1] = argv[0];
  ::execv(program.c_str(), argv + 1);
  throw BackendUnavailable("there is no " + program +
                           ": builds without Embree lack the generator of scenes");
}

}  // namespace gpureg::cli
