// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <fstream>
#include <functional>
#include <string>

#include "json/json_fwd.hpp"

namespace gpureg::cli {

/// Version of the JSON documents and journals that the command writes, as "format_version". It
/// grows when a reader of the version before would misread a document; documents without it are
/// version 1.
inline constexpr int kFormatVersion = 1;

/// A file that may hold a JSON document.
class DocumentFile {
 public:
  /// Throws IoError: no such file, or a folder.
  explicit DocumentFile(std::string path);

  const std::string& path() const { return path_; }

  /// Whether the first character that is not blank begins an object.
  bool begins_object();

  /// Receives an element of a list. What it throws as InvalidArgument is reported with its place.
  using Element = std::function<void(Json&&)>;

  /// Parses the file; call it once. `each` receives the elements of the top-level array `list` one
  /// by one; the document keeps the empty array, so that a large file needs little memory.
  /// @throws IoError naming the file and the reason: no JSON, nested too deeply, an object with too
  ///   many members or with two of one name, a newer format.
  Json read(const char* list = nullptr, const Element& each = {});

 private:
  std::string path_;
  std::ifstream stream_;
};

/// Parses one value, with the limits of a document. Throws InvalidArgument.
Json parse_json(const std::string& text);

/// The last member of a document, an array of objects that are made one by one, by several threads
/// at once.
struct DocumentList {
  const char* name;
  std::size_t size;
  std::function<Json(std::size_t)> element;
};

/// One top-level key a line, and one element of a top-level array of objects a line: a diff or grep
/// of a result finds the pair. Begins with the format version. All or nothing. Throws IoError.
void write_document(const std::string& path, const Json& document);
void write_document(const std::string& path, const Json& head, const DocumentList& last);

}  // namespace gpureg::cli
