// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <functional>
#include <map>
#include <memory>
#include <string>
#include <variant>
#include <vector>

/// JSON (RFC 8259) as far as pose graphs need it. Every complaint is an IoError that names file and
/// line.
namespace gpureg::pose_graph::json {

struct Value;
using Items = std::vector<Value>;
using Members = std::map<std::string, Value, std::less<>>;

/// In the order of Value::content.
enum class Kind { null, boolean, number, text, array, object };

/// Small, since files consist of numbers. No pointer is null.
struct Value {
  std::variant<std::monostate, bool, double, std::unique_ptr<std::string>, std::unique_ptr<Items>,
               std::unique_ptr<Members>>
      content;
  std::size_t line = 0;  ///< where it begins

  Kind kind() const { return static_cast<Kind>(content.index()); }
};
static_assert(sizeof(Value) <= 3 * sizeof(double));

class Document {
 public:
  /// Throws IoError: unreadable, or no JSON.
  explicit Document(const std::string& path);

  const Value& root() const { return root_; }

  /// Throws IoError "path:line: reason".
  [[noreturn]] void fail(std::size_t line, const std::string& reason) const;

  // Members that must be there and of that kind.
  double number(const Value& object, const char* name) const;
  bool boolean(const Value& object, const char* name) const;
  const std::string& text(const Value& object, const char* name) const;
  const Items& array(const Value& object, const char* name) const;
  /// An array of exactly so many finite numbers.
  std::vector<double> numbers(const Value& object, const char* name, std::size_t count) const;
  /// Where a member begins; it must be there.
  std::size_t line(const Value& object, const char* name) const {
    return member(object, name).line;
  }

 private:
  const Value& member(const Value& object, const char* name) const;
  const Value& member(const Value& object, const char* name, Kind kind) const;

  std::string path_;
  Value root_;
};

}  // namespace gpureg::pose_graph::json
