// SPDX-License-Identifier: BSD-3-Clause
#include <array>
#include <string_view>

#include "gpureg/change.hpp"
#include "gpureg/error.hpp"
#include "gpureg/files.hpp"

namespace gpureg::localization {
namespace {

using Colour = std::array<std::uint8_t, 3>;
/// In the order of ChangeLabel.
constexpr std::array<Colour, 5> kColours = {
    {{130, 130, 130}, {0, 160, 60}, {220, 40, 40}, {70, 90, 200}, {205, 205, 205}}};

std::string header_of(const PointCloud& cloud, const char* number) {
  std::string header = "ply\nformat binary_little_endian 1.0\nelement vertex " +
                       std::to_string(cloud.points.size()) + "\n";
  for (const char* axis : {"x", "y", "z"})
    header += std::string("property ") + number + " " + axis + "\n";
  for (const char* name : {"red", "green", "blue", "label"})
    header += std::string("property uchar ") + name + "\n";
  return header + "property float probability\nend_header\n";
}

template <typename T>
void append(std::string& bytes, const T& value) {
  bytes.append(reinterpret_cast<const char*>(&value), sizeof value);
}

}  // namespace

void write_changes(const std::string& path, const PointCloud& cloud, const PointChanges& changes) {
  const auto check = [&](std::size_t count, const char* what) {
    if (count != cloud.points.size())
      throw InvalidArgument("changes has " + std::to_string(count) + " " + what +
                            ", but cloud has " + std::to_string(cloud.points.size()) + " points");
  };
  check(changes.labels.size(), "labels");
  check(changes.probabilities.size(), "probabilities");
  for (const ChangeLabel label : changes.labels)
    if (static_cast<std::size_t>(label) >= kColours.size())
      throw InvalidArgument("changes has the label " + std::to_string(static_cast<int>(label)) +
                            ", expected 0 to " + std::to_string(kColours.size() - 1));
  constexpr std::size_t kAtOnce = 1 << 20;
  const bool wide = !cloud.origin.isZero(0);
  files::write_atomically(path, [&](const files::Sink& write) {
    std::string bytes = header_of(cloud, wide ? "double" : "float");
    for (std::size_t k = 0; k < cloud.points.size(); ++k) {
      for (int axis = 0; axis < 3; ++axis) {
        const float row = cloud.points[k][axis];
        if (wide)
          append(bytes, static_cast<double>(row) + cloud.origin[axis]);
        else
          append(bytes, row);
      }
      const auto label = static_cast<std::uint8_t>(changes.labels[k]);
      append(bytes, kColours[label]);
      append(bytes, label);
      append(bytes, changes.probabilities[k]);
      if (bytes.size() < kAtOnce) continue;
      write(bytes);
      bytes.clear();
    }
    write(bytes);
  });
}

}  // namespace gpureg::localization
