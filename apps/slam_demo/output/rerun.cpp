// SPDX-License-Identifier: BSD-3-Clause
#include "output/rerun.hpp"

#include <spawn.h>
#include <sys/wait.h>

#include <gpureg/error.hpp>
#include <vector>

extern char** environ;

namespace slam_demo {
namespace {

const char* const kProgram =
#include "rerun_log.inc"
    ;

/// The Python program says itself what is wrong.
void run_python(std::vector<std::string> arguments) {
  arguments.insert(arguments.begin(), {"python3", "-c", kProgram});
  std::vector<char*> words;
  for (std::string& argument : arguments) words.push_back(argument.data());
  words.push_back(nullptr);
  pid_t child = 0;
  int status = 0;
  if (posix_spawnp(&child, words[0], nullptr, nullptr, words.data(), environ) != 0 ||
      waitpid(child, &status, 0) != child)
    throw gpureg::Error("--rerun: python3 cannot be run");
  if (!WIFEXITED(status) || WEXITSTATUS(status) != 0)
    throw gpureg::Error("--rerun: python3 with the package rerun-sdk is needed, and it failed");
}

}  // namespace

void require_rerun() { run_python({}); }

void write_rerun(const std::string& results, const std::string& path) {
  run_python({results, path});
}

}  // namespace slam_demo
