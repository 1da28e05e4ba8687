// SPDX-License-Identifier: BSD-3-Clause
#include "files/envelope.hpp"

#include "gpureg/error.hpp"

namespace gpureg::files {
namespace {

constexpr std::size_t kMagicBytes = 8;

}  // namespace

void Envelope::add(std::string_view part) {
  size_ += part.size();
  sum_.add_bytes(part);
}

std::string Envelope::header(const BinaryKind& kind) const {
  const std::uint64_t sum = sum_.value();
  std::string out(kind.magic);
  out += bytes_of(&kind.version, 1);
  out += bytes_of(&size_, 1);
  out += bytes_of(&sum, 1);
  return out;
}

std::string_view payload_of(std::string_view content, const BinaryKind& kind,
                            const std::string& path) {
  const auto error = [&](const std::string& what) { return IoError(path + what); };
  if (content.substr(0, kMagicBytes) != kind.magic) throw error(std::string(" is no ") + kind.name);
  constexpr std::size_t kHeader = kMagicBytes + sizeof kind.version + 2 * sizeof(std::uint64_t);
  if (content.size() < kHeader) throw error(" is truncated");
  PayloadReader header(content.substr(kMagicBytes), path);
  std::uint32_t version;
  std::uint64_t size, sum;
  header.values(&version, 1);
  header.values(&size, 1);
  header.values(&sum, 1);
  if (version != kind.version)
    throw error(" has version " + std::to_string(version) + ", this library reads " +
                std::to_string(kind.version));
  const std::string_view payload = content.substr(kHeader);
  if (size > payload.size()) throw error(" is truncated");
  if (size < payload.size()) throw error(" is longer than its header says");
  Fnv1a found;
  found.add_bytes(payload);
  if (found.value() != sum) throw error(" is damaged: its checksum does not match");
  return payload;
}

void PayloadReader::fail() const {
  throw IoError(path_ + ": its content contradicts itself; the file is damaged");
}

}  // namespace gpureg::files
