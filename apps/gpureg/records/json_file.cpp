// SPDX-License-Identifier: BSD-3-Clause
#include "records/json_file.hpp"

#include <cerrno>
#include <cstdio>
#include <memory>
#include <system_error>

#include "gpureg/error.hpp"
#include "gpureg/evaluation.hpp"
#include "gpureg/files.hpp"

namespace gpureg::cli {
namespace {

// Paths may hold bytes that are no UTF-8; they shall not be able to end a long run.
std::string dump(const Json& json) {
  return json.dump(-1, ' ', false, Json::error_handler_t::replace);
}

void append_value(std::string& text, const Json& value) {
  const bool table = value.is_array() && !value.empty() && value.front().is_object();
  if (!table) {
    text += dump(value);
    return;
  }
  text += "[\n";
  for (std::size_t k = 0; k < value.size(); ++k)
    text += "  " + dump(value[k]) + (k + 1 < value.size() ? ",\n" : "\n");
  text += " ]";
}

constexpr const char* kVersionKey = "format_version";

}  // namespace

void check_format(const std::string& path, const Json& document) {
  if (!document.is_object() || !document.contains(kVersionKey)) return;
  const Json& version = document[kVersionKey];
  if (!version.is_number_integer() || version < 1)
    throw IoError(path + ": \"format_version\" is " + dump(version).substr(0, 40) +
                  ", expected an integer >= 1");
  if (version > kFormatVersion)
    throw IoError(path + ": format version " + dump(version) +
                  ", this gpureg reads versions up to " + std::to_string(kFormatVersion) +
                  "; a newer gpureg wrote it");
}

std::string format_document(const Json& document) {
  std::string text = "{\n \"" + std::string(kVersionKey) + "\": " + std::to_string(kFormatVersion);
  const char* separator = ",\n ";
  for (const auto& item : document.items()) {
    if (item.key() == kVersionKey) continue;  // of a document that was read
    text += separator + dump(Json(item.key())) + ": ";
    append_value(text, item.value());
  }
  return text + "\n}\n";
}

void write_document(const std::string& path, const Json& document) {
  files::write_atomically(path, format_document(document));
}

std::string read_text(const std::string& path) {
  const auto fail = [&](int error) {
    throw IoError("cannot read " + path + ": " + std::generic_category().message(error));
  };
  const std::unique_ptr<std::FILE, int (*)(std::FILE*)> file(std::fopen(path.c_str(), "rb"),
                                                             &std::fclose);
  if (!file) fail(errno);
  std::string text;
  char buffer[1 << 16];
  while (const std::size_t got = std::fread(buffer, 1, sizeof(buffer), file.get()))
    text.append(buffer, got);
  if (std::ferror(file.get())) fail(errno);  // a folder opens, but does not read
  return text;
}

}  // namespace gpureg::cli
