// SPDX-License-Identifier: BSD-3-Clause
#include "files/envelope.hpp"

#include <gtest/gtest.h>

#include "gpureg/error.hpp"

namespace gpureg::files {
namespace {

constexpr BinaryKind kKind{"gpuregXY", 7, "example"};
const std::string kPath = "some.file";

std::string file_of(std::string_view first, std::string_view second) {
  Envelope envelope;
  envelope.add(first);
  envelope.add(second);
  return envelope.header(kKind) + std::string(first) + std::string(second);
}

std::string complaint(std::string_view content) {
  try {
    payload_of(content, kKind, kPath);
  } catch (const IoError& error) {
    return error.what();
  }
  return "none";
}

TEST(Envelope, HoldsAPayloadOfSeveralParts) {
  const std::string content = file_of("abc", "de");
  // Magic, version and size; FNV-1a of "abcde", by another program.
  EXPECT_EQ(content.substr(0, 20), std::string("gpuregXY\7\0\0\0\5\0\0\0\0\0\0\0", 20));
  EXPECT_EQ(content.substr(20, 8), std::string("\xa8\x64\x23\x76\x2d\xc5\x48\x63", 8));
  EXPECT_EQ(payload_of(content, kKind, kPath), "abcde");
  EXPECT_EQ(payload_of(file_of("", ""), kKind, kPath), "");
}

TEST(Envelope, ComplaintsNameTheFileAndTheFault) {
  const std::string content = file_of("abc", "de");
  for (const std::size_t size : {0, 1, 7})
    EXPECT_EQ(complaint(content.substr(0, size)), "some.file is no example");
  EXPECT_EQ(complaint("gpuregXZ" + content.substr(8)), "some.file is no example");
  for (const std::size_t size : {8, 27, 28, 32})
    EXPECT_EQ(complaint(content.substr(0, size)), "some.file is truncated");
  EXPECT_EQ(complaint(content + "f"), "some.file is longer than its header says");
  std::string changed = content;
  changed[8] = 8;
  EXPECT_EQ(complaint(changed), "some.file has version 8, this library reads 7");
  for (std::size_t k = 20; k < content.size(); ++k) {
    changed = content;
    changed[k] = static_cast<char>(changed[k] ^ 1);
    EXPECT_EQ(complaint(changed), "some.file is damaged: its checksum does not match");
  }
}

TEST(Envelope, ReadersTakeNoMoreThanThereIs) {
  const std::uint16_t numbers[3] = {1, 2, 3};
  PayloadReader reader(bytes_of(numbers, 3), kPath);
  std::uint16_t first = 0;
  reader.values(&first, 1);
  EXPECT_EQ(first, 1);
  EXPECT_EQ(reader.left(), 4u);
  std::vector<std::uint16_t> rest;
  EXPECT_THROW(reader.list(rest, ~std::uint64_t(0)), IoError);
  EXPECT_THROW(reader.list(rest, 3), IoError);
  reader.list(rest, 2);
  EXPECT_EQ(rest, (std::vector<std::uint16_t>{2, 3}));
  reader.list(rest, 0);
  EXPECT_THROW(reader.values(&first, 1), IoError);
}

}  // namespace
}  // namespace gpureg::files
