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
#include "view.inc"
    ;

/// The Python program says itself what is wrong. -I: no module of the current folder takes the
/// place of one that it imports.
pid_t start_python(std::vector<std::string> arguments, const posix_spawnattr_t* attributes) {
  arguments.insert(arguments.begin(), {"python3", "-I", "-c", kProgram});
  std::vector<char*> words;
  for (std::string& argument : arguments) words.push_back(argument.data());
  words.push_back(nullptr);
  pid_t child = 0;
  if (posix_spawnp(&child, words[0], nullptr, attributes, words.data(), environ) != 0)
    throw gpureg::Error("--view, --rerun: python3 cannot be run");
  return child;
}

void run_python(const std::vector<std::string>& arguments) {
  const pid_t child = start_python(arguments, nullptr);
  int status = 0;
  if (waitpid(child, &status, 0) != child || !WIFEXITED(status) || WEXITSTATUS(status) != 0)
    throw gpureg::Error("--view, --rerun: python3 with the package rerun-sdk is needed; it failed");
}

}  // namespace

void require_rerun() { run_python({}); }

void start_view(const std::string& results) {
  posix_spawnattr_t attributes;
  posix_spawnattr_init(&attributes);
  posix_spawnattr_setflags(&attributes, POSIX_SPAWN_SETPGROUP);
  try {
    start_python({results}, &attributes);
  } catch (...) {
    posix_spawnattr_destroy(&attributes);
    throw;
  }
  posix_spawnattr_destroy(&attributes);
}

void write_rerun(const std::string& results, const std::string& path) {
  run_python({results, "--save", path, "--wait", "0"});
}

}  // namespace slam_demo
