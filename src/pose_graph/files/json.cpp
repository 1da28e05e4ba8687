// SPDX-License-Identifier: BSD-3-Clause
#include "pose_graph/files/json.hpp"

#include <cmath>
#include <string_view>
#include <system_error>
#include <utility>

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
      fail(std::string("expected '") + c + "', found " + files::in_quotes(text_.substr(at_, 1)));
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
    if (c == '{')
      value.content = object(depth);
    else if (c == '[')
      value.content = array(depth);
    else if (c == '"')
      value.content = std::make_unique<std::string>(string());
    else if (literal("true"))
      value.content = true;
    else if (literal("false"))
      value.content = false;
    else if (!literal("null"))
      value.content = number();
    return value;
  }

  std::unique_ptr<Members> object(int depth) {
    auto members = std::make_unique<Members>();
    expect('{');
    if (peek() == '}') {
      ++at_;
      return members;
    }
    for (;;) {
      if (peek() != '"') fail("expected the name of a member");
      std::string name = string();
      if (members->count(name) > 0) fail("the member " + files::in_quotes(name) + " stands twice");
      expect(':');
      members->emplace(std::move(name), parse(depth + 1));
      if (peek() == '}') break;
      expect(',');
    }
    ++at_;
    return members;
  }

  std::unique_ptr<Items> array(int depth) {
    auto items = std::make_unique<Items>();
    expect('[');
    if (peek() == ']') {
      ++at_;
      return items;
    }
    for (;;) {
      items->push_back(parse(depth + 1));
      if (peek() == ']') break;
      expect(',');
    }
    ++at_;
    return items;
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
      fail("expected a JSON value, found " + files::in_quotes(text_.substr(at_, stop - at_)));
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

const Value& Document::member(const Value& object, const char* name) const {
  if (object.kind() != Kind::object)
    fail(object.line, std::string("expected an object, found ") + name_of(object.kind()));
  const Members& members = *std::get<std::unique_ptr<Members>>(object.content);
  const auto found = members.find(name);
  if (found == members.end())
    fail(object.line, std::string("the object that begins here has no ") + name);
  return found->second;
}

const Value& Document::member(const Value& object, const char* name, Kind kind) const {
  const Value& value = member(object, name);
  if (value.kind() != kind)
    fail(value.line,
         std::string(name) + " is " + name_of(value.kind()) + ", expected " + name_of(kind));
  return value;
}

double Document::number(const Value& object, const char* name) const {
  return std::get<double>(member(object, name, Kind::number).content);
}

bool Document::boolean(const Value& object, const char* name) const {
  return std::get<bool>(member(object, name, Kind::boolean).content);
}

const std::string& Document::text(const Value& object, const char* name) const {
  return *std::get<std::unique_ptr<std::string>>(member(object, name, Kind::text).content);
}

const Items& Document::array(const Value& object, const char* name) const {
  return *std::get<std::unique_ptr<Items>>(member(object, name, Kind::array).content);
}

std::vector<double> Document::numbers(const Value& object, const char* name,
                                      std::size_t count) const {
  const Items& items = array(object, name);
  if (items.size() != count)
    fail(line(object, name), std::string(name) + " has " + std::to_string(items.size()) +
                                 " numbers, expected " + std::to_string(count));
  std::vector<double> out;
  for (const Value& item : items) {
    if (item.kind() != Kind::number)
      fail(item.line, std::string(name) + " holds " + name_of(item.kind()) + ", expected a number");
    out.push_back(std::get<double>(item.content));
  }
  return out;
}

}  // namespace gpureg::pose_graph::json
