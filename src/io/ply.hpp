// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "gpureg/point_cloud.hpp"
#include "io/source.hpp"
#include "io/table.hpp"

/// Polygon files (G. Turk, 1994), in all three encodings.
namespace gpureg::io {

enum class PlyFormat { ascii, binary_little_endian, binary_big_endian };

struct PlyProperty {
  Column column;                     ///< of a list: name and type of its members
  std::optional<Scalar> list_count;  ///< type of the count before a list; none: a plain number
};

struct PlyElement {
  std::string name;
  std::size_t count = 0;
  std::vector<PlyProperty> properties;

  bool has_list() const;
  Table table() const;  ///< of the properties that are no lists
};

struct PlyHeader {
  PlyFormat format = PlyFormat::ascii;
  std::vector<PlyElement> elements;
};

/// Reads up to and including the line end_header. Throws IoError naming file and line.
PlyHeader read_ply_header(Source& source);

/// A whole file. Throws IoError.
PointCloud read_ply(Source& source);

}  // namespace gpureg::io
