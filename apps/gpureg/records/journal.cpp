// SPDX-License-Identifier: BSD-3-Clause
#include "records/journal.hpp"

#include <fcntl.h>
#include <sys/file.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstdint>
#include <cstdio>
#include <fstream>
#include <string_view>
#include <system_error>

#include "gpureg/error.hpp"
#include "json/json.hpp"
#include "json/json_fields.hpp"
#include "json/json_file.hpp"
#include "records/pair_json.hpp"
#include "records/result_json.hpp"

namespace gpureg::cli {
namespace {

[[noreturn]] void fail(const std::string& path, const char* what, int error) {
  throw IoError(std::string("cannot ") + what + " " + path + ": " +
                std::generic_category().message(error));
}

/// The scan of a header that was there before and is not now, or has another content; empty: none.
std::string changed_scan(const Json& before, const Json& now) {
  const auto name_of = [](const Json& scan) {
    return scan.is_object() ? scan.value("name", std::string()) : std::string();
  };
  const Json none = Json::array(), scans = now.value("fragments", none);
  for (const Json& scan : before.value("fragments", none)) {
    if (name_of(scan).empty()) continue;
    const auto same = std::find_if(scans.begin(), scans.end(), [&](const Json& other) {
      return name_of(other) == name_of(scan);
    });
    if (same == scans.end()) return name_of(scan) + " is not there any more";
    if (same->value("hash", Json()) != scan.value("hash", Json()))
      return name_of(scan) + " is another cloud than before";
  }
  return "";
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

constexpr const char* kHeader = "gpureg_journal";  // the first member of a header

void lock_file(int fd, const std::string& path) {
  if (::flock(fd, LOCK_EX | LOCK_NB) != 0 && errno == EWOULDBLOCK)
    throw IoError(path + " is in use: another run writes the same result");
}

// A header alone holds no work that could be lost.
void refuse_unfinished(const std::string& path) {
  std::ifstream file(path, std::ios::binary);
  std::string header;
  if (!std::getline(file, header) || file.eof() || file.peek() == std::ifstream::traits_type::eof())
    return;
  throw IoError(path + " is of an unfinished run: --resume continues it, --restart discards it");
}

constexpr std::size_t kChecksumDigits = 16;

/// FNV-1a, as 16 hexadecimal digits.
std::string checksum(std::string_view text) {
  std::uint64_t hash = 14695981039346656037ull;
  for (const char c : text) hash = (hash ^ static_cast<unsigned char>(c)) * 1099511628211ull;
  char digits[kChecksumDigits + 1];
  std::snprintf(digits, sizeof digits, "%016llx", static_cast<unsigned long long>(hash));
  return digits;
}

/// The text of a line without its newline. Throws InvalidArgument.
std::string checked_text(const std::string& line) {
  if (!line.empty() && line[0] == '{')
    throw InvalidArgument("it has no checksum, an older gpureg wrote it");
  std::string text = line.substr(std::min(line.size(), kChecksumDigits + 1));
  if (line.size() - text.size() != kChecksumDigits + 1 || line[kChecksumDigits] != ' ' ||
      line.compare(0, kChecksumDigits, checksum(text)) != 0)
    throw InvalidArgument("its checksum does not match");
  return text;
}

Json moments_to_json(const CorrespondenceMoments& moments) {
  return {
      {"count", moments.count}, {"sum", to_json(moments.sum)}, {"outer", to_json(moments.outer)}};
}

CorrespondenceMoments moments_from_json(const Json& json) {
  const Json &count = member(json, "count"), &sum = member(json, "sum");
  if (!count.is_number_unsigned()) throw InvalidArgument("\"count\" of moments is no count");
  if (!sum.is_array() || sum.size() != 3)
    throw InvalidArgument("\"sum\" of moments is not an array of 3 numbers");
  CorrespondenceMoments moments;
  moments.count = count.get<std::uint64_t>();
  for (int k = 0; k < 3; ++k)
    moments.sum[k] = finite_number(sum[static_cast<std::size_t>(k)], "sum");
  moments.outer = square_matrix<3>(member(json, "outer"), "outer");
  return moments;
}

}  // namespace

void Journal::check(const std::string& path, Mode mode) {
  const int fd = ::open(path.c_str(), O_RDONLY | O_CLOEXEC);
  if (fd < 0) return;  // no journal, or an error that the constructor reports
  try {
    lock_file(fd, path);
    if (mode == Mode::fresh) refuse_unfinished(path);
  } catch (...) {
    ::close(fd);
    throw;
  }
  ::close(fd);
}

std::string Journal::line_of(const std::string& text) { return checksum(text) + " " + text + "\n"; }

Json Journal::header(const std::string& path) {
  std::ifstream file(path);
  std::string line;
  if (!std::getline(file, line)) return nullptr;
  try {
    return parse_json(checked_text(line));
  } catch (const InvalidArgument&) {
    return nullptr;  // the constructor says so
  }
}

Journal::Journal(std::string path, const HeaderOf& header_of, Mode mode, const Take& take)
    : path_(std::move(path)) {
  fd_ = ::open(path_.c_str(), O_RDWR | O_CREAT | O_CLOEXEC, 0666);
  if (fd_ < 0) fail(path_, "write", errno);
  try {
    lock_file(fd_, path_);
    if (mode == Mode::fresh) refuse_unfinished(path_);
    const std::size_t good = mode == Mode::resume ? take_up(header_of, take) : 0;
    if (::ftruncate(fd_, static_cast<off_t>(good)) != 0) fail(path_, "write", errno);
    if (::lseek(fd_, 0, SEEK_END) < 0) fail(path_, "write", errno);
    if (const std::string header = header_of(nullptr).dump(); header != earlier_) {
      pending_ = line_of(header);
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
std::size_t Journal::take_up(const HeaderOf& header_of, const Take& take) {
  std::ifstream file(path_, std::ios::binary);
  std::size_t good = 0, number = 0;
  for (std::string line; std::getline(file, line) && !file.eof(); good += line.size() + 1) {
    ++number;
    try {
      const Json json = parse_json(checked_text(line));
      if (number == 1 || json.contains(kHeader))
        take_header(json, header_of);
      else
        take_line(json, take);
    } catch (const IoError&) {
      throw;
    } catch (const std::exception& error) {
      throw IoError("cannot resume from " + path_ + ": line " + std::to_string(number) +
                    " is damaged (" + error.what() + "); call " + kAnew);
    }
  }
  return good;
}

void Journal::take_header(const Json& earlier, const HeaderOf& header_of) {
  if (const Json now = header_of(&earlier); now != earlier) {
    const std::string scan = changed_scan(earlier, now);
    throw IoError("cannot resume from " + path_ + ": " +
                  (scan.empty() ? difference(earlier, now, "") + "; call with the same options, or "
                                : scan + "; put it back, or call ") +
                  kAnew);
  }
  earlier_ = earlier.dump();
}

void Journal::take_line(const Json& json, const Take& take) {
  if (json.contains("outputs")) {
    wrote_outputs_ = true;
    return;
  }
  const Json& pair = member(json, "pair");
  RegistrationResult result = result_from_json(pair);
  result.source_moments = moments_from_json(member(json, "source_moments"));
  take(fragment_member(pair, "i"), fragment_member(pair, "j"), std::move(result));
}

void Journal::add(int i, int j, const RegistrationResult& result) {
  const Json line = {{"pair", pair_to_json(i, j, result)},
                     {"source_moments", moments_to_json(result.source_moments)}};
  pending_ += line_of(line.dump());
}

void Journal::note_outputs() {
  if (!wrote_outputs_) pending_ += line_of(Json{{"outputs", "as far as here"}}.dump());
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
