// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <string>
#include <utility>
#include <vector>

/// JSON (RFC 8259) as far as pose graphs need it. Every complaint is an IoError that names file and
/// line.
namespace gpureg::pose_graph::json {

enum class Kind { null, boolean, number, text, array, object };

struct Value {
  Kind kind = Kind::null;
  std::size_t line = 0;  ///< where it begins
  bool boolean = false;
  double number = 0;
  std::string text;
  std::vector<Value> items;                            ///< of an array
  std::vector<std::pair<std::string, Value>> members;  ///< of an object
};

class Document {
 public:
  /// Throws IoError: unreadable, or no JSON.
  explicit Document(const std::string& path);

  const Value& root() const { return root_; }

  /// Throws IoError "path:line: reason".
  [[noreturn]] void fail(std::size_t line, const std::string& reason) const;

  /// A member that must be there and of that kind.
  const Value& member(const Value& object, const char* name, Kind kind) const;

  /// A member that is an array of exactly so many finite numbers.
  std::vector<double> numbers(const Value& object, const char* name, std::size_t count) const;

 private:
  std::string path_;
  Value root_;
};

}  // namespace gpureg::pose_graph::json
