// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <sys/resource.h>
#include <sys/types.h>

#include <chrono>
#include <initializer_list>
#include <string>
#include <vector>

namespace gpureg::test {

/// How a run of the command ended.
struct Outcome {
  int status = -1;  ///< exit status; -1: ended by a signal
  int signal = 0;
  std::string out, err;  ///< err: without lines of progress
};

/// What the process that runs the command finds.
struct Surroundings {
  rlim_t file_bytes = RLIM_INFINITY;  ///< no file may grow beyond: writes fail as on a full disk
  std::string standard_output;        ///< a path instead of Outcome::out
};

/// The built command as a child process, with the given arguments after its name.
class Command {
 public:
  explicit Command(const std::vector<std::string>& arguments, const Surroundings& around = {});
  Command(const Command&) = delete;
  Command& operator=(const Command&) = delete;
  ~Command();  ///< kills what still runs

  void send(int signal);
  bool running();

  /// A command that hangs is killed after the time limit and fails the test; so does one that a
  /// sanitizer complains about.
  Outcome wait(std::chrono::seconds limit = std::chrono::seconds(300));

 private:
  void read_available(int timeout_ms);

  pid_t pid_ = -1;
  int out_ = -1, err_ = -1;
  bool ended_ = false;
  int raw_status_ = 0;
  std::string out_text_, err_text_;
};

Outcome run(const std::vector<std::string>& arguments, const Surroundings& around = {});

/// The command must end with status 2 and say why in one line on stderr, with every one of the
/// fragments in it.
void expect_refused(const std::vector<std::string>& arguments,
                    std::initializer_list<std::string> fragments, const Surroundings& around = {});

/// Text must hold every one of the fragments.
void expect_holds(const std::string& text, std::initializer_list<std::string> fragments);

}  // namespace gpureg::test
