// SPDX-License-Identifier: BSD-3-Clause
#include "cli/command.hpp"

#include <fcntl.h>
#include <gtest/gtest.h>
#include <poll.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <csignal>
#include <regex>
#include <sstream>
#include <stdexcept>

namespace gpureg::test {
namespace {

// Returns false at the end of the stream.
bool drain(int fd, std::string& text) {
  char buffer[1 << 14];
  const ssize_t got = ::read(fd, buffer, sizeof(buffer));
  if (got > 0) text.append(buffer, static_cast<std::size_t>(got));
  return got > 0;
}

/// Lines of progress come where a stage takes longer than a few seconds: no test may depend on it.
std::string without_progress(const std::string& text) {
  static const std::regex progress("^[a-z ]+ [0-9]+/[0-9]+ [a-z]+(,.*)?$");
  std::istringstream lines(text);
  std::string out;
  for (std::string line; std::getline(lines, line);)
    if (!std::regex_match(line, progress)) out += line + (lines.eof() ? "" : "\n");
  return out;
}

}  // namespace

Command::Command(const std::vector<std::string>& arguments, const Surroundings& around) {
  std::vector<char*> argv = {const_cast<char*>(GPUREG_COMMAND)};
  for (const std::string& argument : arguments) argv.push_back(const_cast<char*>(argument.c_str()));
  argv.push_back(nullptr);
  int out[2], err[2];
  if (::pipe2(out, O_CLOEXEC) != 0 || ::pipe2(err, O_CLOEXEC) != 0)
    throw std::runtime_error("no pipe");
  pid_ = ::fork();
  if (pid_ < 0) throw std::runtime_error("no process");
  if (pid_ == 0) {
    if (!around.standard_output.empty()) out[1] = ::open(around.standard_output.c_str(), O_WRONLY);
    ::dup2(out[1], STDOUT_FILENO);
    ::dup2(err[1], STDERR_FILENO);
    rlimit limit{};
    ::getrlimit(RLIMIT_FSIZE, &limit);
    limit.rlim_cur = std::min(limit.rlim_max, around.file_bytes);
    ::setrlimit(RLIMIT_FSIZE, &limit);
    ::execv(GPUREG_COMMAND, argv.data());
    ::_exit(127);
  }
  ::close(out[1]);
  ::close(err[1]);
  out_ = out[0];
  err_ = err[0];
}

Command::~Command() {
  if (!ended_) {
    ::kill(pid_, SIGKILL);
    ::waitpid(pid_, nullptr, 0);
  }
  for (const int fd : {out_, err_})
    if (fd >= 0) ::close(fd);
}

void Command::send(int signal) {
  if (running()) ::kill(pid_, signal);
}

bool Command::running() {
  if (!ended_) ended_ = ::waitpid(pid_, &raw_status_, WNOHANG) == pid_;
  return !ended_;
}

void Command::read_available(int timeout_ms) {
  pollfd fds[2] = {{out_, POLLIN, 0}, {err_, POLLIN, 0}};
  if (::poll(fds, 2, timeout_ms) <= 0) return;
  const auto take = [](const pollfd& state, int& fd, std::string& text) {
    if (state.revents == 0 || drain(state.fd, text)) return;
    ::close(fd);
    fd = -1;  // poll() passes over it
  };
  take(fds[0], out_, out_text_);
  take(fds[1], err_, err_text_);
}

Outcome Command::wait(std::chrono::seconds limit) {
  const auto end = std::chrono::steady_clock::now() + limit;
  while ((out_ >= 0 || err_ >= 0) && std::chrono::steady_clock::now() < end) read_available(100);
  if (out_ >= 0 || err_ >= 0) {
    ADD_FAILURE() << "the command hangs";
    ::kill(pid_, SIGKILL);
  }
  if (!ended_) ::waitpid(pid_, &raw_status_, 0);
  ended_ = true;
  Outcome outcome;
  if (WIFEXITED(raw_status_)) outcome.status = WEXITSTATUS(raw_status_);
  if (WIFSIGNALED(raw_status_)) outcome.signal = WTERMSIG(raw_status_);
  outcome.out = out_text_;
  outcome.err = without_progress(err_text_);
  // They end a process with status 1, which means something else here.
  for (const char* complaint : {"Sanitizer", "runtime error:"})
    EXPECT_EQ(outcome.err.find(complaint), std::string::npos) << outcome.err;
  return outcome;
}

Outcome run(const std::vector<std::string>& arguments, const Surroundings& around) {
  return Command(arguments, around).wait();
}

void expect_refused(const std::vector<std::string>& arguments,
                    std::initializer_list<std::string> fragments, const Surroundings& around) {
  std::string line;
  for (const std::string& argument : arguments) line += " " + argument;
  SCOPED_TRACE("gpureg" + line);
  const Outcome outcome = run(arguments, around);
  EXPECT_EQ(outcome.status, 2) << "signal " << outcome.signal;
  EXPECT_EQ(outcome.err.rfind("gpureg: ", 0), 0u) << outcome.err;
  EXPECT_EQ(std::count(outcome.err.begin(), outcome.err.end(), '\n'), 1) << outcome.err;
  expect_holds(outcome.err, fragments);
}

void expect_holds(const std::string& text, std::initializer_list<std::string> fragments) {
  for (const std::string& fragment : fragments)
    EXPECT_NE(text.find(fragment), std::string::npos)
        << "text: " << text << "\nlacks: " << fragment;
}

}  // namespace gpureg::test
