// SPDX-License-Identifier: BSD-3-Clause
#include "inputs/python_file.hpp"

#include <fcntl.h>
#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <csignal>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <system_error>
#include <vector>

#include "gpureg/error.hpp"
#include "gpureg/io.hpp"

extern "C" char** environ;

namespace gpureg::cli {
namespace {

/// No module is taken from the working folder, as `python -m` would.
constexpr const char* kScript =
    "import sys; sys.path[:] = filter(None, sys.path); from gpureg._convert import main; "
    "sys.exit(main())";

class Descriptor {
 public:
  explicit Descriptor(int fd = -1) : fd_(fd) {}
  Descriptor(const Descriptor&) = delete;
  Descriptor& operator=(const Descriptor&) = delete;
  ~Descriptor() { close(); }
  int get() const { return fd_; }
  void set(int fd) { fd_ = fd; }
  void close() {
    if (fd_ >= 0) ::close(fd_);
    fd_ = -1;
  }

 private:
  int fd_;
};

[[noreturn]] void fail_system(const std::string& what) {
  throw IoError(what + ": " + std::generic_category().message(errno));
}

/// A file without a name, which ends with the process.
void open_temporary(Descriptor& file) {
  std::string name = (std::filesystem::temp_directory_path() / "gpureg-XXXXXX").string();
  file.set(::mkstemp(name.data()));
  if (file.get() < 0) fail_system("cannot write a file into " + name);
  ::unlink(name.c_str());
  ::fcntl(file.get(), F_SETFD, FD_CLOEXEC);
}

/// Starts the interpreter with standard output and error at these descriptors.
pid_t start(std::vector<std::string> arguments, int out, int err) {
  std::vector<char*> argv;
  for (std::string& argument : arguments) argv.push_back(argument.data());
  argv.push_back(nullptr);
  posix_spawn_file_actions_t actions;
  ::posix_spawn_file_actions_init(&actions);
  ::posix_spawn_file_actions_addopen(&actions, STDIN_FILENO, "/dev/null", O_RDONLY, 0);
  ::posix_spawn_file_actions_adddup2(&actions, out, STDOUT_FILENO);
  ::posix_spawn_file_actions_adddup2(&actions, err, STDERR_FILENO);
  // Where this process finishes its file after Ctrl-C, the other one has to.
  sigset_t blocked;
  ::sigprocmask(SIG_BLOCK, nullptr, &blocked);
  for (const int signal : {SIGINT, SIGTERM}) {
    struct sigaction now{};
    ::sigaction(signal, nullptr, &now);
    if (now.sa_handler != SIG_DFL) ::sigaddset(&blocked, signal);
  }
  posix_spawnattr_t attributes;
  ::posix_spawnattr_init(&attributes);
  ::posix_spawnattr_setflags(&attributes, POSIX_SPAWN_SETSIGMASK);
  ::posix_spawnattr_setsigmask(&attributes, &blocked);
  pid_t pid = -1;
  errno = ::posix_spawnp(&pid, argv[0], &actions, &attributes, argv.data(), environ);
  ::posix_spawnattr_destroy(&attributes);
  ::posix_spawn_file_actions_destroy(&actions);
  if (errno != 0) fail_system("cannot start " + arguments[0] + ", which GPUREG_PYTHON names");
  return pid;
}

/// The end of what is written to a pipe.
std::string read_end(int pipe) {
  constexpr std::size_t kKept = 1 << 14;
  std::string text;
  std::array<char, 4096> buffer{};
  for (;;) {
    const ssize_t got = ::read(pipe, buffer.data(), buffer.size());
    if (got < 0 && errno == EINTR) continue;
    if (got <= 0) return text;
    text.append(buffer.data(), static_cast<std::size_t>(got));
    if (text.size() > 2 * kKept) text.erase(0, text.size() - kKept);
  }
}

int wait_for(pid_t pid) {
  int status = 0;
  while (::waitpid(pid, &status, 0) < 0)
    if (errno != EINTR) return -1;
  return status;
}

std::string last_line(std::string text) {
  while (!text.empty() && (text.back() == '\n' || text.back() == ' ')) text.pop_back();
  return text.substr(text.rfind('\n') + 1);
}

/// Whether the comments of a PLY file say that the origin is the viewpoint.
bool seen_from_origin(int file) {
  std::array<char, 1024> start{};
  const ssize_t got = ::pread(file, start.data(), start.size(), 0);
  const std::string_view text(start.data(), static_cast<std::size_t>(std::max<ssize_t>(got, 0)));
  return text.substr(0, text.find("end_header")).find("comment viewpoint 0 0 0\n") != text.npos;
}

}  // namespace

bool is_for_python(const std::string& path) {
  const std::string file = io::scan_path(path).file;
  std::error_code ignored;
  if (!std::filesystem::is_regular_file(file, ignored)) return false;
  std::array<char, 8> start{};
  std::ifstream(file, std::ios::binary).read(start.data(), start.size());
  const std::string_view bytes(start.data(), start.size());
  if (bytes.substr(0, 4) == "LASF" || bytes == "ASTM-E57") return true;
  std::string extension = std::filesystem::path(file).extension().string();
  for (char& c : extension)
    if (c >= 'A' && c <= 'Z') c = static_cast<char>(c - 'A' + 'a');
  return extension == ".las" || extension == ".laz" || extension == ".e57";
}

PointCloud read_by_python(const std::string& path) {
  const char* const python = std::getenv("GPUREG_PYTHON");
  if (python == nullptr || *python == '\0') return io::read_point_cloud(path);  // says what to do
  const io::ScanPath scan = io::scan_path(path);
  Descriptor out;
  open_temporary(out);
  std::array<int, 2> ends{};
  if (::pipe(ends.data()) != 0) fail_system("cannot make a pipe");
  Descriptor errors(ends[0]), write_end(ends[1]);
  for (const int end : ends) ::fcntl(end, F_SETFD, FD_CLOEXEC);
  const pid_t pid = start({python, "-c", kScript, scan.file, std::to_string(scan.part)}, out.get(),
                          write_end.get());
  write_end.close();
  const std::string said = last_line(read_end(errors.get()));
  if (const int status = wait_for(pid); status != 0)
    throw IoError(!said.empty() ? said
                                : "cannot read " + path + ": " + python +
                                      (WIFSIGNALED(status) ? " was ended by a signal" : " failed"));
  ::lseek(out.get(), 0, SEEK_SET);
  PointCloud cloud;
  try {
    cloud = io::read_point_cloud("/dev/fd/" + std::to_string(out.get()));
  } catch (const IoError& error) {
    throw IoError("cannot read " + path + ": " + error.what());
  }
  if (seen_from_origin(out.get())) cloud.set_viewpoints({Eigen::Vector3d::Zero()});
  return cloud;
}

}  // namespace gpureg::cli
