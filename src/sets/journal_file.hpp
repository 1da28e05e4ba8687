// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <string>
#include <string_view>

/// The file of a PairJournal: a magic and a version, then records. A record is its kind and size
/// with a checksum, its payload, and the checksum of that: a changed bit is told from a torn end.
namespace gpureg::sets {

inline constexpr std::string_view kJournalMagic = "gpuregPJ";
inline constexpr std::uint32_t kJournalVersion = 2;

enum RecordKind : std::uint32_t {
  kSettings = 1,  ///< name=value, a line each
  kCloud = 2,     ///< name, 0, fingerprint; its number is that of clouds before it
  kPair = 3,      ///< numbers of target and source, bytes_of() the result
  kNote = 4       ///< a 64-bit number
};

/// Before the first record.
std::string journal_head();
std::string record_of(std::uint32_t kind, std::string_view payload);

[[noreturn]] void fail(const std::string& path, const char* what, int error);

/// Reads the records of a file in their order.
class RecordReader {
 public:
  /// @throws DamagedJournal where the file is of another kind or version. IoError.
  RecordReader(int fd, const std::string& path);

  /// False at the end of the last whole record.
  /// @throws DamagedJournal.
  bool next();

  std::uint32_t kind() const { return kind_; }
  const std::string& payload() const { return payload_; }
  std::uint64_t payload_at() const { return at_ - payload_.size() - sizeof(std::uint64_t); }
  std::uint64_t end() const { return at_; }  ///< of the whole records so far; 0: not even a head

  [[noreturn]] void damaged(const std::string& why) const;

 private:
  bool is_zero_from(std::uint64_t at) const;

  int fd_;
  const std::string& path_;
  std::uint64_t at_ = 0, size_ = 0;
  std::uint32_t kind_ = 0;
  std::string payload_;
  std::size_t number_ = 0;
};

/// Reads a part of a file. @throws IoError where it is not there.
std::string read_part(int fd, const std::string& path, std::uint64_t at, std::size_t size);

}  // namespace gpureg::sets
