// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <cstring>
#include <string>
#include <string_view>
#include <type_traits>
#include <vector>

#include "common/fnv1a.hpp"

/// Binary files of the library: magic, version, size and checksum of the payload, payload. All
/// numbers are little-endian, as those of every processor that the library runs on.
namespace gpureg::files {

struct BinaryKind {
  std::string_view magic;  ///< eight characters
  std::uint32_t version;
  const char* name;  ///< "a saved map": for messages
};

template <typename T>
std::string_view bytes_of(const T* values, std::size_t count) {
  return {reinterpret_cast<const char*>(values), count * sizeof(T)};
}

/// The header of a payload that is added part by part.
class Envelope {
 public:
  void add(std::string_view part);
  std::string header(const BinaryKind& kind) const;

 private:
  Fnv1a sum_;
  std::uint64_t size_ = 0;
};

/// The payload of a file. Throws IoError where it is of another kind or version, or damaged.
std::string_view payload_of(std::string_view content, const BinaryKind& kind,
                            const std::string& path);

/// Takes a payload apart. Throws IoError where it is too short.
class PayloadReader {
 public:
  PayloadReader(std::string_view payload, const std::string& path) : rest_(payload), path_(path) {}

  template <typename T>
  void values(T* out, std::uint64_t count) {
    if (count > rest_.size() / sizeof(T)) fail();
    if (count > 0) std::memcpy(static_cast<void*>(out), rest_.data(), count * sizeof(T));
    rest_.remove_prefix(count * sizeof(T));
  }
  template <typename T>
  void list(std::vector<T>& out, std::uint64_t count) {
    if (count > rest_.size() / sizeof(T)) fail();  // before memory is asked for
    out.resize(count);
    values(out.data(), count);
  }
  std::size_t left() const { return rest_.size(); }
  [[noreturn]] void fail() const;

 private:
  std::string_view rest_;
  const std::string& path_;
};

}  // namespace gpureg::files
