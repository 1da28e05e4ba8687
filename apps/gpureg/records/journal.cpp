// SPDX-License-Identifier: BSD-3-Clause
#include "records/journal.hpp"

#include <fcntl.h>
#include <sys/file.h>
#include <unistd.h>

#include <cerrno>
#include <system_error>

#include "gpureg/error.hpp"
#include "records/json_file.hpp"

namespace gpureg::cli {
namespace {

[[noreturn]] void fail(const std::string& path, const char* what, int error) {
  throw IoError(std::string("cannot ") + what + " " + path + ": " +
                std::generic_category().message(error));
}

// Names the first part of the header that is not the same.
std::string difference(const Json& before, const Json& now, const std::string& name) {
  if (before.is_object() && now.is_object())
    for (const auto& item : now.items()) {
      const std::string inner = name.empty() ? item.key() : name + "." + item.key();
      const auto found = before.find(item.key());
      if (found == before.end()) return inner + " was not given";
      if (*found != item.value()) return difference(*found, item.value(), inner);
    }
  if (before.is_array() && now.is_array()) {
    if (before.size() != now.size())
      return name + " had " + std::to_string(before.size()) + " entries, now " +
             std::to_string(now.size());
    for (std::size_t k = 0; k < now.size(); ++k)
      if (before[k] != now[k])
        return difference(before[k], now[k], name + "[" + std::to_string(k) + "]");
  }
  return name + " was " + before.dump() + ", now " + now.dump();
}

constexpr const char* kAnew = "with --restart instead of --resume to start anew";

void lock(int fd, const std::string& path) {
  if (::flock(fd, LOCK_EX | LOCK_NB) != 0 && errno == EWOULDBLOCK)
    throw IoError(path + " is in use: another run writes the same result");
}

// A header alone holds no work that could be lost.
void refuse_unfinished(const std::string& path, const std::string& text) {
  const std::size_t header = text.find('\n');
  if (header == std::string::npos || header + 1 == text.size()) return;
  throw IoError(path + " is of an unfinished run: --resume continues it, --restart discards it");
}

}  // namespace

void Journal::check(const std::string& path, Mode mode) {
  const int fd = ::open(path.c_str(), O_RDONLY | O_CLOEXEC);
  if (fd < 0) return;  // no journal, or an error that the constructor reports
  try {
    lock(fd, path);
    if (mode == Mode::fresh) refuse_unfinished(path, read_text(path));
  } catch (...) {
    ::close(fd);
    throw;
  }
  ::close(fd);
}

Journal::Journal(std::string path, const Json& header, Mode mode) : path_(std::move(path)) {
  fd_ = ::open(path_.c_str(), O_RDWR | O_CREAT | O_CLOEXEC, 0666);
  if (fd_ < 0) fail(path_, "write", errno);
  try {
    lock(fd_, path_);
    const std::string text = read_text(path_);
    if (mode == Mode::fresh) refuse_unfinished(path_, text);
    const std::size_t good = mode == Mode::resume ? take_up(text, header) : 0;
    if (::ftruncate(fd_, static_cast<off_t>(good)) != 0) fail(path_, "write", errno);
    if (::lseek(fd_, 0, SEEK_END) < 0) fail(path_, "write", errno);
    if (good == 0) {
      pending_ = header.dump() + "\n";
      flush();
    }
  } catch (...) {
    ::close(fd_);
    throw;
  }
}

Journal::~Journal() {
  if (fd_ >= 0) ::close(fd_);
}

// Returns the length of the part that is whole.
std::size_t Journal::take_up(const std::string& text, const Json& header) {
  std::size_t good = 0;
  for (std::size_t line = 0;; ++line) {
    const std::size_t end = text.find('\n', good);
    if (end == std::string::npos) return good;  // torn, or nothing left
    try {
      const Json json = Json::parse(text.begin() + static_cast<std::ptrdiff_t>(good),
                                    text.begin() + static_cast<std::ptrdiff_t>(end));
      if (line == 0) {
        if (json != header)
          throw IoError("cannot resume from " + path_ + ": " + difference(json, header, "") +
                        "; call with the same options, or " + kAnew);
      } else if (json.contains("outputs")) {
        wrote_outputs_ = true;
      } else {
        Entry entry{PairRecord::from_json(json.at("pair")), json.at("information")};
        information_from_json(entry.information);
        const std::pair<int, int> key(entry.pair.i, entry.pair.j);
        entries_.emplace(key, std::move(entry));
      }
    } catch (const IoError&) {
      throw;
    } catch (const std::exception& error) {
      throw IoError("cannot resume from " + path_ + ": line " + std::to_string(line + 1) +
                    " is damaged (" + error.what() + "); call " + kAnew);
    }
    good = end + 1;
  }
}

void Journal::add(const PairRecord& pair, const Json& information) {
  entries_.emplace(std::make_pair(pair.i, pair.j), Entry{pair, information});
  pending_ += Json{{"pair", pair.json}, {"information", information}}.dump() + "\n";
}

void Journal::note_outputs() {
  if (!wrote_outputs_) pending_ += Json{{"outputs", "as far as here"}}.dump() + "\n";
  wrote_outputs_ = true;
  flush();
}

void Journal::flush() {
  std::size_t written = 0;
  while (written < pending_.size()) {
    const ssize_t n = ::write(fd_, pending_.data() + written, pending_.size() - written);
    if (n < 0 && errno == EINTR) continue;
    if (n < 0) {
      // The written part may end in the middle of a line; nothing may follow it.
      const int error = errno;
      pending_.clear();
      fail(path_, "write", error);
    }
    written += static_cast<std::size_t>(n);
  }
  pending_.clear();
}

void Journal::remove() {
  if (::unlink(path_.c_str()) != 0) fail(path_, "delete", errno);
}

}  // namespace gpureg::cli
