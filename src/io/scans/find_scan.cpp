// SPDX-License-Identifier: BSD-3-Clause
#include "gpureg/io.hpp"
#include "io/scans/names.hpp"

namespace gpureg::io {

std::optional<std::size_t> find_scan(const std::vector<ScanFile>& scans, std::string_view word) {
  const auto place = [&](const auto& is) -> std::optional<std::size_t> {
    std::optional<std::size_t> found;
    for (std::size_t k = 0; k < scans.size(); ++k) {
      if (!is(scans[k])) continue;
      if (found) return {};  // of several
      found = k;
    }
    return found;
  };
  if (const auto number = scans::numbered(word); number && number->before.empty())
    return place([&](const ScanFile& scan) { return scan.number == number->number; });
  const auto base = [](const ScanFile& scan) {
    return std::string_view(scan.name).substr(scan.name.rfind('/') + 1);
  };
  if (const auto k = place([&](const ScanFile& scan) { return scan.name == word; })) return k;
  if (const auto k = place([&](const ScanFile& scan) { return base(scan) == word; })) return k;
  if (const auto k = place([&](const ScanFile& s) { return scans::stem_of(s.name) == word; }))
    return k;
  return place([&](const ScanFile& scan) { return scans::stem_of(base(scan)) == word; });
}

}  // namespace gpureg::io
