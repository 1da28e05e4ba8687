// SPDX-License-Identifier: BSD-3-Clause
#include "json/json_file.hpp"

#include <algorithm>
#include <cerrno>
#include <filesystem>
#include <future>
#include <sstream>
#include <string>
#include <system_error>
#include <thread>
#include <utility>
#include <vector>

#include "gpureg/error.hpp"
#include "gpureg/files.hpp"
#include "json/json.hpp"

namespace gpureg::cli {
namespace {

constexpr const char* kVersionKey = "format_version";

/// Documents nest seven deep. Copies and dumps of the JSON library recurse: a deeper document would
/// only serve to exhaust the stack.
constexpr std::size_t kDeepest = 64;
/// Of one object. Ordered objects are searched from the front, so that many members cost their
/// square.
constexpr std::size_t kMostMembers = 1000;

// The library's number of the error, which its messages begin with, means nothing to a user.
std::string plain(const std::string& message) {
  const std::size_t end = message.find("] ");
  return message.rfind("[json.", 0) == 0 && end != std::string::npos ? message.substr(end + 2)
                                                                     : message;
}

// Paths may hold bytes that are no UTF-8; they shall not be able to end a long run.
std::string dump(const Json& json) {
  return json.dump(-1, ' ', false, Json::error_handler_t::replace);
}

/// Makes a document of the parser's events. Throws InvalidArgument.
class Builder : public nlohmann::json_sax<Json> {
 public:
  Builder(const char* list, const DocumentFile::Element& each) : list_(list), each_(each) {}

  Json take() { return std::move(root_); }

  bool null() override { return add(nullptr); }
  bool boolean(bool value) override { return add(value); }
  bool number_integer(number_integer_t value) override { return add(value); }
  bool number_unsigned(number_unsigned_t value) override { return add(value); }
  bool number_float(number_float_t value, const string_t&) override { return add(value); }
  bool string(string_t& value) override { return add(std::move(value)); }
  bool binary(binary_t&) override { return false; }  // not in texts
  bool start_object(std::size_t) override { return open(Json::object()); }
  bool start_array(std::size_t) override { return open(Json::array()); }
  bool end_object() override { return close(); }
  bool end_array() override { return close(); }

  bool key(string_t& name) override {
    const Json& object = open_.back().value;
    if (object.size() >= kMostMembers)
      throw InvalidArgument("an object has more than " + std::to_string(kMostMembers) + " members");
    if (object.contains(name))
      throw InvalidArgument("the member " + dump(name).substr(0, 40) +
                            " of an object stands twice");
    open_.back().key = std::move(name);
    return true;
  }

  bool parse_error(std::size_t, const std::string&, const Json::exception& error) override {
    throw InvalidArgument(plain(error.what()));
  }

 private:
  struct Level {
    Json value;
    std::string key;  ///< of the member that comes next
  };

  bool open(Json value) {
    if (open_.size() >= kDeepest)
      throw InvalidArgument("the JSON is nested more than " + std::to_string(kDeepest) + " deep");
    open_.push_back({std::move(value), {}});
    return true;
  }

  bool close() {
    Json value = std::move(open_.back().value);
    open_.pop_back();
    return add(std::move(value));
  }

  bool add(Json value) {
    if (open_.empty()) {
      root_ = std::move(value);
    } else if (Level& parent = open_.back(); parent.value.is_object()) {
      parent.value[parent.key] = std::move(value);
    } else if (in_list()) {
      hand_on(std::move(value));
    } else {
      parent.value.push_back(std::move(value));
    }
    return true;
  }

  bool in_list() const {
    return list_ != nullptr && open_.size() == 2 && open_[0].value.is_object() &&
           open_[0].key == list_;
  }

  void hand_on(Json&& value) {
    const std::string where = list_ + ("[" + std::to_string(count_++) + "]: ");
    try {
      each_(std::move(value));
    } catch (const InvalidArgument& error) {
      throw InvalidArgument(where + error.what());
    } catch (const Json::exception& error) {
      throw InvalidArgument(where + plain(error.what()));
    }
  }

  const char* list_;
  const DocumentFile::Element& each_;
  std::vector<Level> open_;
  Json root_;
  std::size_t count_ = 0;
};

Json parse(std::istream& stream, const char* list, const DocumentFile::Element& each) {
  Builder builder(list, each);
  Json::sax_parse(stream, &builder);
  return builder.take();
}

/// Throws InvalidArgument where a newer gpureg wrote the document.
void check_format(const Json& document) {
  if (!document.is_object() || !document.contains(kVersionKey)) return;
  const Json& version = document[kVersionKey];
  if (!version.is_number_integer() || version < 1)
    throw InvalidArgument("\"format_version\" is " + dump(version).substr(0, 40) +
                          ", expected an integer >= 1");
  if (version > kFormatVersion)
    throw InvalidArgument("format version " + dump(version) +
                          ", this gpureg reads versions up to " + std::to_string(kFormatVersion) +
                          "; a newer gpureg wrote it");
}

template <typename Element>
void write_list(const files::Sink& write, std::size_t size, const Element& element) {
  write("[\n");
  for (std::size_t k = 0; k < size; ++k)
    write("  " + dump(element(k)) + (k + 1 < size ? ",\n" : "\n"));
  write(" ]");
}

/// Elements that are made before they are written: some megabytes.
constexpr std::size_t kElementsAtOnce = 1024;

/// write_list(), with the elements made and dumped on all cores: a hundred thousand pairs are a
/// gigabyte of text.
void write_list_on_all_cores(const files::Sink& write, const DocumentList& list) {
  const std::size_t threads = std::max(1u, std::thread::hardware_concurrency());
  std::vector<std::string> texts;
  write("[\n");
  for (std::size_t first = 0; first < list.size; first += kElementsAtOnce) {
    texts.resize(std::min(kElementsAtOnce, list.size - first));
    std::vector<std::future<void>> parts;
    for (std::size_t part = 0; part < std::min(threads, texts.size()); ++part)
      parts.push_back(std::async(std::launch::async, [&, part] {
        for (std::size_t k = part; k < texts.size(); k += threads)
          texts[k] = dump(list.element(first + k));
      }));
    for (std::future<void>& part : parts) part.wait();
    for (std::future<void>& part : parts) part.get();
    for (std::size_t k = 0; k < texts.size(); ++k)
      write("  " + texts[k] + (first + k + 1 < list.size ? ",\n" : "\n"));
  }
  write(" ]");
}

void write_member(const files::Sink& write, const std::string& name, const Json& value) {
  write(",\n " + dump(name) + ": ");
  if (value.is_array() && !value.empty() && value.front().is_object())
    write_list(write, value.size(), [&](std::size_t k) -> const Json& { return value[k]; });
  else
    write(dump(value));
}

}  // namespace

DocumentFile::DocumentFile(std::string path) : path_(std::move(path)), stream_(path_) {
  const int error = stream_ ? 0 : errno != 0 ? errno : EIO;
  std::error_code ignored;
  const int reason = std::filesystem::is_directory(path_, ignored) ? EISDIR : error;
  if (reason != 0)
    throw IoError("cannot read " + path_ + ": " + std::generic_category().message(reason));
}

bool DocumentFile::begins_object() {
  stream_ >> std::ws;
  return stream_.peek() == '{';
}

Json DocumentFile::read(const char* list, const Element& each) try {
  Json document = parse(stream_, list, each);
  check_format(document);
  return document;
} catch (const InvalidArgument& error) {
  throw IoError(path_ + ": " + error.what());
} catch (const std::ios_base::failure& error) {
  throw IoError("cannot read " + path_ + ": " + error.what());
}

Json parse_json(const std::string& text) {
  std::istringstream stream(text);
  return parse(stream, nullptr, {});
}

void write_document(const std::string& path, const Json& document) {
  write_document(path, document, {nullptr, 0, {}});
}

void write_document(const std::string& path, const Json& head, const DocumentList& last) {
  files::write_atomically(path, [&](const files::Sink& write) {
    write("{\n \"" + std::string(kVersionKey) + "\": " + std::to_string(kFormatVersion));
    for (const auto& item : head.items())
      if (item.key() != kVersionKey)  // of a document that was read
        write_member(write, item.key(), item.value());
    if (last.size > 0) {
      write(",\n " + dump(last.name) + ": ");
      write_list_on_all_cores(write, last);
    } else if (last.name != nullptr) {
      write_member(write, last.name, Json::array());
    }
    write("\n}\n");
  });
}

}  // namespace gpureg::cli
