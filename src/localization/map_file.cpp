// SPDX-License-Identifier: BSD-3-Clause
#include <cmath>

#include "common/coordinates.hpp"
#include "common/limits.hpp"
#include "fields/localization.hpp"
#include "files/envelope.hpp"
#include "files/text_file.hpp"
#include "gpureg/error.hpp"
#include "gpureg/files.hpp"
#include "localization/map_state.hpp"

namespace gpureg::localization {
namespace {

constexpr files::BinaryKind kKind{"gpuregMP", 4, "saved map of gpureg"};
/// Of a file that is read: keeps devices and mistaken paths from eating the memory.
constexpr std::size_t kMostBytes = std::size_t{1} << 36;

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
  each_number(map.given, [&](const auto& value) { write(files::bytes_of(&value, 1)); });
  write(files::bytes_of(map.origin.data(), 3));
  const std::uint64_t counts[4] = {map.points.size(), map.sides.size(), map.viewpoints.size(),
                                   map.sides_inferred};
  write(files::bytes_of(counts, 4));
  write(files::bytes_of(map.points.data(), map.points.size()));
  write(files::bytes_of(map.sides.data(), map.sides.size()));
  write(files::bytes_of(map.viewpoints.data(), map.viewpoints.size()));
  write(files::bytes_of(map.horizons.data(), map.horizons.size()));
}

/// A file with a correct checksum may still come from elsewhere.
void check_values(const MapState& map, const std::string& path) {
  const auto require_that = [&](bool holds, const char* what) {
    if (!holds) throw IoError(path + ": " + what + "; the file is damaged");
  };
  try {
    map.given.validate();
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
  files::Envelope envelope;
  each_part(map, [&](std::string_view part) { envelope.add(part); });
  files::write_atomically(path, [&](const files::Sink& write) {
    write(envelope.header(kKind));
    each_part(map, write);
  });
}

PreparedMap PreparedMap::load(const std::string& path) {
  auto map = std::make_shared<MapState>();
  {
    const std::string content = files::read_file(path, kMostBytes);
    files::PayloadReader file(files::payload_of(content, kKind, path), path);
    each_number(map->given, [&](auto& value) { file.values(&value, 1); });
    file.values(map->origin.data(), 3);
    std::uint64_t counts[4];
    file.values(counts, 4);
    if (counts[3] > 1) file.fail();
    map->sides_inferred = counts[3] == 1;
    file.list(map->points, counts[0]);
    file.list(map->sides, counts[1]);
    file.list(map->viewpoints, counts[2]);
    file.list(map->horizons, counts[2]);
    if (file.left() > 0) file.fail();
  }
  check_values(*map, path);
  map->options = resolve(map->given);
  map->make_tiles();
  return MapState::map(std::move(map));
}

bool PreparedMap::is_saved(const std::string& path) {
  return files::read_start(path, kKind.magic.size()) == kKind.magic;
}

}  // namespace gpureg::localization
