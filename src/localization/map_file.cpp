// SPDX-License-Identifier: BSD-3-Clause
#include <cmath>
#include <cstring>

#include "common/coordinates.hpp"
#include "common/limits.hpp"
#include "fields/localization.hpp"
#include "files/text_file.hpp"
#include "gpureg/error.hpp"
#include "gpureg/files.hpp"
#include "localization/map_state.hpp"

namespace gpureg::localization {
namespace {

// Layout: kMagic, version, size and checksum of the payload, payload. All numbers little-endian, as
// every processor that the library runs on.
constexpr char kMagic[8] = {'g', 'p', 'u', 'r', 'e', 'g', 'M', 'P'};
constexpr std::uint32_t kVersion = 3;
constexpr std::size_t kHeader = sizeof kMagic + sizeof kVersion + 2 * sizeof(std::uint64_t);
/// Of a file that is read: keeps devices and mistaken paths from eating the memory.
constexpr std::size_t kMostBytes = std::size_t{1} << 36;

/// FNV-1a, of words.
class Checksum {
 public:
  void add(std::string_view part) {
    size_ += part.size();
    for (const char c : part) hash_ = (hash_ ^ static_cast<unsigned char>(c)) * 1099511628211ull;
  }
  std::uint64_t value() const { return hash_; }
  std::uint64_t size() const { return size_; }

 private:
  std::uint64_t hash_ = 14695981039346656037ull, size_ = 0;
};

template <typename T>
std::string_view bytes_of(const T* values, std::size_t count) {
  return {reinterpret_cast<const char*>(values), count * sizeof(T)};
}

/// Calls with_value(reference) for every number of the options, in the order of their fields.
template <typename T, typename With>
void each_number(T& object, const With& with) {
  fields::each<std::remove_const_t<T>>([&](const std::string&, auto member, const fields::Field&) {
    auto& value = object.*member;
    if constexpr (std::is_arithmetic_v<std::decay_t<decltype(value)>>)
      with(value);
    else
      each_number(value, with);
  });
}

/// The payload, part by part.
void each_part(const MapState& map, const files::Sink& write) {
  each_number(map.options, [&](const auto& value) { write(bytes_of(&value, 1)); });
  write(bytes_of(map.origin.data(), 3));
  const std::uint64_t counts[4] = {map.points.size(), map.sides.size(), map.viewpoints.size(),
                                   map.sides_inferred};
  write(bytes_of(counts, 4));
  write(bytes_of(map.points.data(), map.points.size()));
  write(bytes_of(map.sides.data(), map.sides.size()));
  write(bytes_of(map.viewpoints.data(), map.viewpoints.size()));
  write(bytes_of(map.horizons.data(), map.horizons.size()));
}

/// Takes the payload apart.
class Reader {
 public:
  Reader(std::string_view rest, const std::string& path) : rest_(rest), path_(path) {}

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
  bool at_end() const { return rest_.empty(); }
  [[noreturn]] void fail() const {
    throw IoError(path_ + ": its content contradicts itself; the file is damaged");
  }

 private:
  std::string_view rest_;
  const std::string& path_;
};

template <typename T>
T number_at(const std::string& content, std::size_t at) {
  T value;
  std::memcpy(&value, content.data() + at, sizeof value);
  return value;
}

void check_header(const std::string& content, const std::string& path) {
  if (content.compare(0, sizeof kMagic, kMagic, sizeof kMagic) != 0)
    throw IoError(path + " is no saved map of gpureg");
  if (content.size() < kHeader) throw IoError(path + " is truncated");
  const auto version = number_at<std::uint32_t>(content, sizeof kMagic);
  if (version != kVersion)
    throw IoError(path + " has version " + std::to_string(version) + ", this library reads " +
                  std::to_string(kVersion));
  const auto size = number_at<std::uint64_t>(content, sizeof kMagic + sizeof kVersion);
  const auto sum = number_at<std::uint64_t>(content, sizeof kMagic + sizeof kVersion + sizeof size);
  if (size > content.size() - kHeader) throw IoError(path + " is truncated");
  if (size < content.size() - kHeader) throw IoError(path + " is longer than its header says");
  Checksum found;
  found.add(std::string_view(content).substr(kHeader));
  if (found.value() != sum) throw IoError(path + " is damaged: its checksum does not match");
}

/// A file with a correct checksum may still come from elsewhere.
void check_values(const MapState& map, const std::string& path) {
  const auto require_that = [&](bool holds, const char* what) {
    if (!holds) throw IoError(path + ": " + what + "; the file is damaged");
  };
  try {
    map.options.validate();
  } catch (const InvalidArgument& error) {
    require_that(false, error.what());
  }
  require_that(map.origin.cwiseAbs().maxCoeff() <= limits::kMaxCoordinate,
               "its origin is not finite, or beyond 1e12");
  require_that(!map.points.empty(), "it has no points");
  require_that(map.points.size() <= limits::kMaxPoints, "it has more than 2^31 - 1 points");
  require_that(map.sides.empty() || map.sides.size() == map.points.size(),
               "points and sides differ in number");
  for (const auto* rows : {&map.points, &map.viewpoints})
    for (const Eigen::Vector3f& row : *rows) require_that(row.allFinite(), "a row is not finite");
}

}  // namespace

void PreparedMap::save(const std::string& path) const {
  const MapState& map = MapState::of(*this);
  Checksum sum;
  each_part(map, [&](std::string_view part) { sum.add(part); });
  files::write_atomically(path, [&](const files::Sink& write) {
    const std::uint64_t size = sum.size(), value = sum.value();
    write(bytes_of(kMagic, sizeof kMagic));
    write(bytes_of(&kVersion, 1));
    write(bytes_of(&size, 1));
    write(bytes_of(&value, 1));
    each_part(map, write);
  });
}

PreparedMap PreparedMap::load(const std::string& path) {
  auto map = std::make_shared<MapState>();
  {
    const std::string content = files::read_file(path, kMostBytes);
    check_header(content, path);
    Reader file(std::string_view(content).substr(kHeader), path);
    each_number(map->options, [&](auto& value) { file.values(&value, 1); });
    file.values(map->origin.data(), 3);
    std::uint64_t counts[4];
    file.values(counts, 4);
    if (counts[3] > 1) file.fail();
    map->sides_inferred = counts[3] == 1;
    file.list(map->points, counts[0]);
    file.list(map->sides, counts[1]);
    file.list(map->viewpoints, counts[2]);
    file.list(map->horizons, counts[2]);
    if (!file.at_end()) file.fail();
  }
  check_values(*map, path);
  map->make_tiles();
  return MapState::map(std::move(map));
}

bool PreparedMap::is_saved(const std::string& path) {
  return files::read_start(path, sizeof kMagic) == std::string(kMagic, sizeof kMagic);
}

}  // namespace gpureg::localization
