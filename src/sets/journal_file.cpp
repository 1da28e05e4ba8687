// SPDX-License-Identifier: BSD-3-Clause
#include "sets/journal_file.hpp"

#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <system_error>

#include "common/fnv1a.hpp"
#include "files/envelope.hpp"
#include "gpureg/sets/pair_journal.hpp"

namespace gpureg::sets {
namespace {

std::uint64_t checksum(std::string_view bytes) {
  Fnv1a sum;
  sum.add_bytes(bytes);
  return sum.value();
}

template <typename T>
void add(std::string& out, const T& value) {
  out += files::bytes_of(&value, 1);
}

constexpr std::size_t kHeader = 2 * sizeof(std::uint32_t);  // before its checksum
constexpr std::size_t kChecksum = sizeof(std::uint64_t);

}  // namespace

void fail(const std::string& path, const char* what, int error) {
  throw IoError(std::string("cannot ") + what + " " + path + ": " +
                std::generic_category().message(error));
}

std::string journal_head() {
  std::string out(kJournalMagic);
  add(out, kJournalVersion);
  return out;
}

std::string record_of(std::uint32_t kind, std::string_view payload) {
  std::string out;
  add(out, kind);
  add(out, static_cast<std::uint32_t>(payload.size()));
  add(out, checksum(out));
  out += payload;
  add(out, checksum(payload));
  return out;
}

std::string read_part(int fd, const std::string& path, std::uint64_t at, std::size_t size) {
  std::string out(size, '\0');
  for (std::size_t have = 0; have < size;) {
    const ssize_t n = ::pread(fd, out.data() + have, size - have, static_cast<off_t>(at + have));
    if (n < 0 && errno == EINTR) continue;
    if (n < 0) fail(path, "read", errno);
    if (n == 0) throw IoError("cannot read " + path + ": it has become shorter");
    have += static_cast<std::size_t>(n);
  }
  return out;
}

RecordReader::RecordReader(int fd, const std::string& path) : fd_(fd), path_(path) {
  struct stat status{};
  if (::fstat(fd_, &status) != 0) fail(path_, "read", errno);
  size_ = static_cast<std::uint64_t>(status.st_size);
  const std::string head = journal_head();
  const std::string begin = read_part(fd_, path_, 0, std::min<std::uint64_t>(size_, head.size()));
  if (begin != head.substr(0, begin.size()))
    damaged(begin.compare(0, kJournalMagic.size(), kJournalMagic) == 0
                ? "another version of gpureg wrote it"
                : "it is no journal, or an older gpureg wrote it");
  if (begin.size() == head.size()) at_ = head.size();
}

void RecordReader::damaged(const std::string& why) const {
  throw DamagedJournal(path_ + " is damaged" +
                       (number_ > 0 ? " in record " + std::to_string(number_) : "") + ": " + why);
}

bool RecordReader::is_zero_from(std::uint64_t at) const {
  constexpr std::uint64_t kPiece = 1 << 20;
  for (; at < size_; at += kPiece) {
    const std::string piece = read_part(fd_, path_, at, std::min(kPiece, size_ - at));
    if (piece.find_first_not_of('\0') != std::string::npos) return false;
  }
  return true;
}

bool RecordReader::next() {
  if (at_ == 0 || size_ - at_ < kHeader + kChecksum) return false;
  ++number_;
  const std::string header = read_part(fd_, path_, at_, kHeader + kChecksum);
  files::PayloadReader reader(header, path_);
  std::uint32_t size = 0;
  std::uint64_t sum = 0;
  reader.values(&kind_, 1);
  reader.values(&size, 1);
  reader.values(&sum, 1);
  if (checksum(std::string_view(header).substr(0, kHeader)) != sum) {
    if (is_zero_from(at_)) return false;  // a power cut leaves zeros of what was not written
    damaged("its checksum does not match");
  }
  if (size_ - at_ - header.size() < std::uint64_t{size} + kChecksum) return false;
  payload_ = read_part(fd_, path_, at_ + header.size(), size + kChecksum);
  files::PayloadReader(std::string_view(payload_).substr(size), path_).values(&sum, 1);
  payload_.resize(size);
  if (checksum(payload_) != sum) damaged("its checksum does not match");
  at_ += header.size() + size + kChecksum;
  return true;
}

}  // namespace gpureg::sets
