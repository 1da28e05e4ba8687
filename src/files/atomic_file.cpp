// SPDX-License-Identifier: BSD-3-Clause
#include <fcntl.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

#include <atomic>
#include <cerrno>
#include <climits>
#include <cstdlib>
#include <filesystem>
#include <memory>
#include <mutex>
#include <set>
#include <string_view>
#include <system_error>
#include <utility>

#include "gpureg/error.hpp"
#include "gpureg/files.hpp"

namespace gpureg::files {
namespace {

[[noreturn]] void fail(const std::string& path, const std::string& reason) {
  throw IoError("cannot write " + path + ": " + reason);
}

std::string why(int error) { return std::generic_category().message(error); }

// An open file which the destructor closes, and deletes again unless it was kept.
class OutputFile {
 public:
  OutputFile(int fd, std::string remove_path) : fd_(fd), remove_path_(std::move(remove_path)) {}
  OutputFile(OutputFile&& other) noexcept
      : fd_(std::exchange(other.fd_, -1)),
        remove_path_(std::exchange(other.remove_path_, std::string())) {}
  ~OutputFile() {
    if (fd_ >= 0) ::close(fd_);
    if (!remove_path_.empty()) ::unlink(remove_path_.c_str());
  }

  int fd() const { return fd_; }
  void keep() { remove_path_.clear(); }

  // close() is where network file systems report a full disk.
  int close() {
    const int result = ::close(fd_) == 0 ? 0 : errno;
    fd_ = -1;
    return result;
  }

 private:
  int fd_;
  std::string remove_path_;
};

int write_all(int fd, std::string_view rest) {
  while (!rest.empty()) {
    const ssize_t written = ::write(fd, rest.data(), rest.size());
    if (written < 0) {
      if (errno == EINTR) continue;
      return errno;
    }
    rest.remove_prefix(static_cast<std::size_t>(written));
  }
  return 0;
}

using Content = std::function<void(const Sink&)>;

void write_content(const OutputFile& file, const std::string& path, const Content& content) {
  content([&](std::string_view part) {
    if (const int error = write_all(file.fd(), part)) fail(path, why(error));
  });
}

// Devices and pipes cannot be replaced by a rename (as root it would even succeed, and /dev/null be
// gone).
void write_special_file(const std::string& path, const Content& content) {
  OutputFile file(::open(path.c_str(), O_WRONLY | O_CLOEXEC), {});
  if (file.fd() < 0) fail(path, why(errno));
  write_content(file, path, content);
  if (const int error = file.close()) fail(path, why(error));
}

std::string folder_of(const std::string& path) {
  const std::size_t slash = path.rfind('/');
  if (slash == std::string::npos) return "./";
  return path.substr(0, slash + 1);
}

constexpr std::string_view kPrefix = ".gpureg-", kSuffix = ".tmp";

bool is_temporary(std::string_view name) {
  return name.size() > kPrefix.size() + kSuffix.size() &&
         name.substr(0, kPrefix.size()) == kPrefix &&
         name.substr(name.size() - kSuffix.size()) == kSuffix;
}

// Temporary files are locked while they are written: a lock ends with its process.
bool lock(int fd) { return ::flock(fd, LOCK_EX | LOCK_NB) == 0; }

// Whether an open file still has this name.
bool has_name(int fd, const std::string& path) {
  struct stat open_file{}, named{};
  return ::fstat(fd, &open_file) == 0 && ::lstat(path.c_str(), &named) == 0 &&
         open_file.st_dev == named.st_dev && open_file.st_ino == named.st_ino;
}

// Removes temporary files that killed processes left. Looks into each folder once.
void remove_leftovers(const std::string& folder) {
  static std::mutex mutex;
  static std::set<std::string> seen;
  const std::lock_guard<std::mutex> guard(mutex);
  if (!seen.insert(folder).second) return;
  std::error_code error;
  for (std::filesystem::directory_iterator at(folder, error), end; !error && at != end;
       at.increment(error)) {
    if (!is_temporary(at->path().filename().native())) continue;
    const std::string& path = at->path().native();
    const OutputFile file(::open(path.c_str(), O_RDWR | O_NOFOLLOW | O_NONBLOCK | O_CLOEXEC), {});
    if (file.fd() >= 0 && lock(file.fd()) && has_name(file.fd(), path)) ::unlink(path.c_str());
  }
}

// The name does not derive from the final one, which may already be as long as the file system
// allows.
OutputFile open_temporary(const std::string& path, std::string& temporary) {
  static std::atomic<unsigned> counter{0};
  for (int attempt = 0; attempt < 100; ++attempt) {
    temporary = folder_of(path) + std::string(kPrefix) + std::to_string(::getpid()) + "-" +
                std::to_string(counter++) + std::string(kSuffix);
    const int fd = ::open(temporary.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, 0666);
    if (fd < 0 && errno != EEXIST) fail(path, why(errno));
    if (fd < 0) continue;
    OutputFile file(fd, temporary);
    // Another process may take the file for a leftover before it is locked.
    if ((lock(fd) || errno != EWOULDBLOCK) && has_name(fd, temporary)) return file;
  }
  fail(path, "no free name for a temporary file");
}

// Without this a power cut may forget the rename; where a file system cannot sync folders there is
// nothing better to do.
void sync_folder(const std::string& folder) {
  const int fd = ::open(folder.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC);
  if (fd < 0) return;
  (void)::fsync(fd);
  ::close(fd);
}

// A rename would replace a link itself: write where it points to, whether or not a file is there.
std::string behind_links(std::string path) {
  constexpr int kMostLinks = 40;  // as the system follows
  for (int k = 0; k < kMostLinks; ++k) {
    char to[PATH_MAX];
    const ssize_t size = ::readlink(path.c_str(), to, sizeof to);
    if (size <= 0) break;
    const std::string next(to, static_cast<std::size_t>(size));
    path = next.front() == '/' ? next : folder_of(path) + next;
  }
  return path;
}

}  // namespace

void write_atomically(const std::string& path, const std::string& content) {
  write_atomically(path, [&](const Sink& write) { write(content); });
}

void write_atomically(const std::string& path, const Content& content) {
  if (path.empty()) fail("''", "the path is empty");
  struct stat existing{};
  const bool exists = ::stat(path.c_str(), &existing) == 0;
  if (!exists && errno != ENOENT) fail(path, why(errno));
  if (exists && S_ISDIR(existing.st_mode)) fail(path, "it is a folder");
  if (exists && !S_ISREG(existing.st_mode)) return write_special_file(path, content);
  // The folder alone decides about a rename; a file that was made read-only on purpose should stay
  // as it is.
  if (exists && ::access(path.c_str(), W_OK) != 0) fail(path, why(errno));

  const std::string target = behind_links(path);
  remove_leftovers(folder_of(target));
  std::string temporary;
  OutputFile file = open_temporary(target, temporary);
  const OutputFile locked(::fcntl(file.fd(), F_DUPFD_CLOEXEC, 0), {});  // until it has its name
  if (exists) (void)::fchmod(file.fd(), existing.st_mode & 07777);
  write_content(file, path, content);
  if (::fsync(file.fd()) != 0) fail(path, why(errno));
  if (const int error = file.close()) fail(path, why(error));
  if (::rename(temporary.c_str(), target.c_str()) != 0) fail(path, why(errno));
  file.keep();
  sync_folder(folder_of(target));
}

}  // namespace gpureg::files
