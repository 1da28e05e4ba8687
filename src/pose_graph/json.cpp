// SPDX-License-Identifier: BSD-3-Clause
#include "pose_graph/json.hpp"

#include <cmath>
#include <string_view>
#include <system_error>

#include "files/numbers.hpp"
#include "files/text_file.hpp"
#include "gpureg/error.hpp"

namespace gpureg::pose_graph::json {
namespace {

/// Pose graphs nest four deep; deeper files would only serve to exhaust the stack.
constexpr int kDeepest = 64;

const char* name_of(Kind kind) {
  switch (kind) {
    case Kind::null:
      return "null";
    case Kind::boolean:
      return "true or false";
    case Kind::number:
      return "a number";
    case Kind::text:
      return "a string";
    case Kind::array:
      return "an array";
    case Kind::object:
      return "an object";
  }
  return "a value";
}

class Parser {
 public:
  Parser(const Document& document, std::string_view text) : document_(document), text_(text) {}

  Value run() {
    Value value = parse(0);
    skip_space();
    if (at_ < text_.size()) fail("text follows the end of the JSON value");
    return value;
  }

 private:
  [[noreturn]] void fail(const std::string& reason) const { document_.fail(line_, reason); }

  void skip_space() {
    for (; at_ < text_.size(); ++at_) {
      const char c = text_[at_];
      if (c == '\n')
        ++line_;
      else if (c != ' ' && c != '\t' && c != '\r')
        return;
    }
  }

  char peek() {
    skip_space();
    if (at_ >= text_.size()) fail("the file ends within a JSON value");
    return text_[at_];
  }

  void expect(char c) {
    if (peek() != c)
      fail(std::string("expected '") + c + "', found " + files::quoted(text_.substr(at_, 1)));
    ++at_;
  }

  bool literal(std::string_view word) {
    if (text_.substr(at_, word.size()) != word) return false;
    at_ += word.size();
    return true;
  }

  Value parse(int depth) {
    if (depth > kDeepest)
      fail("the JSON is nested more than " + std::to_string(kDeepest) + " deep");
    Value value;
    const char c = peek();
    value.line = line_;
    if (c == '{') {
      value.kind = Kind::object;
      object(value, depth);
    } else if (c == '[') {
      value.kind = Kind::array;
      array(value, depth);
    } else if (c == '"') {
      value.kind = Kind::text;
      value.text = string();
    } else if (literal("true")) {
      value.kind = Kind::boolean;
      value.boolean = true;
    } else if (literal("false")) {
      value.kind = Kind::boolean;
    } else if (!literal("null")) {
      value.kind = Kind::number;
      value.number = number();
    }
    return value;
  }

  void object(Value& value, int depth) {
    expect('{');
    if (peek() == '}') {
      ++at_;
      return;
    }
    for (;;) {
      if (peek() != '"') fail("expected the name of a member");
      std::string name = string();
      for (const auto& member : value.members)
        if (member.first == name) fail("the member " + files::quoted(name) + " stands twice");
      expect(':');
      value.members.emplace_back(std::move(name), parse(depth + 1));
      if (peek() == '}') break;
      expect(',');
    }
    ++at_;
  }

  void array(Value& value, int depth) {
    expect('[');
    if (peek() == ']') {
      ++at_;
      return;
    }
    for (;;) {
      value.items.push_back(parse(depth + 1));
      if (peek() == ']') break;
      expect(',');
    }
    ++at_;
  }

  /// Escapes are kept as they stand: no name that a pose graph needs has one.
  std::string string() {
    std::string out;
    for (++at_; at_ < text_.size() && text_[at_] != '"'; ++at_) {
      if (text_[at_] == '\n') fail("a string does not end on its line");
      out += text_[at_];
      if (text_[at_] == '\\' && at_ + 1 < text_.size()) out += text_[++at_];
    }
    if (at_ >= text_.size()) fail("the file ends within a string");
    ++at_;
    return out;
  }

  double number() {
    double value = 0;
    const char* begin = text_.data() + at_;
    const auto [end, error] = files::from_chars(begin, text_.data() + text_.size(), value);
    const bool starts = *begin == '-' || (*begin >= '0' && *begin <= '9');
    if (!starts || error != std::errc() || !std::isfinite(value)) {
      const std::size_t stop = text_.find_first_of(" \t\r\n,]}", at_);
      fail("expected a JSON value, found " + files::quoted(text_.substr(at_, stop - at_)));
    }
    at_ += static_cast<std::size_t>(end - begin);
    return value;
  }

  const Document& document_;
  std::string_view text_;
  std::size_t at_ = 0;
  std::size_t line_ = 1;
};

}  // namespace

Document::Document(const std::string& path) : path_(path) {
  const std::string content = files::read_file(path);
  root_ = Parser(*this, content).run();
}

void Document::fail(std::size_t line, const std::string& reason) const {
  throw IoError(path_ + ":" + std::to_string(line) + ": " + reason);
}

const Value& Document::member(const Value& object, const char* name, Kind kind) const {
  if (object.kind != Kind::object)
    fail(object.line, std::string("expected an object, found ") + name_of(object.kind));
  for (const auto& [key, value] : object.members) {
    if (key != name) continue;
    if (value.kind != kind)
      fail(value.line,
           std::string(name) + " is " + name_of(value.kind) + ", expected " + name_of(kind));
    return value;
  }
  fail(object.line, std::string("the object that begins here has no ") + name);
}

std::vector<double> Document::numbers(const Value& object, const char* name,
                                      std::size_t count) const {
  const Value& array = member(object, name, Kind::array);
  if (array.items.size() != count)
    fail(array.line, std::string(name) + " has " + std::to_string(array.items.size()) +
                         " numbers, expected " + std::to_string(count));
  std::vector<double> out;
  for (const Value& item : array.items) {
    if (item.kind != Kind::number)
      fail(item.line, std::string(name) + " holds " + name_of(item.kind) + ", expected a number");
    out.push_back(item.number);
  }
  return out;
}

}  // namespace gpureg::pose_graph::json
