// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <map>
#include <set>
#include <string_view>
#include <utility>

#include "gpureg/error.hpp"
#include "io/extension.hpp"
#include "io/scans/folder.hpp"
#include "io/scans/names.hpp"

namespace gpureg::io::scans {
namespace {

std::string ending(const Found& cloud) { return cloud.name.substr(stem_of(cloud.name).size()); }

/// The one of two clouds whose extension more of the others have.
const Found& usual(const Found& a, const Found& b, const Contents& contents) {
  const auto count = [&](const Found& of) {
    return std::count_if(contents.clouds.begin(), contents.clouds.end(),
                         [&](const Found& cloud) { return ending(cloud) == ending(of); });
  };
  return count(b) > count(a) ? b : a;
}

}  // namespace

void drop_doubles(const std::string& where, Contents& contents) {
  const auto is_text = [](const Found& file) { return is_text_extension(extension_of(file.name)); };
  std::map<std::string_view, const Found*> by_stem;
  std::set<const Found*> dropped;
  for (const bool texts : {false, true})
    for (const Found& cloud : contents.clouds) {
      if (is_text(cloud) != texts) continue;
      const auto [first, is_new] = by_stem.emplace(stem_of(cloud.name), &cloud);
      if (is_new) continue;
      if (!texts)
        throw IoError(
            where + " has " + printable(first->second->name) + " and " + printable(cloud.name) +
            ", which look like one scan in two formats: choose one, as with '" + where + "/*" +
            ending(usual(*first->second, cloud, contents)) + "', or give a list of files");
      dropped.insert(&cloud);
    }
  std::vector<Found> kept;
  for (const Found& cloud : contents.clouds)
    if (dropped.count(&cloud) > 0)
      contents.others.push_back(cloud.name);
    else
      kept.push_back(cloud);
  contents.clouds = std::move(kept);
}

}  // namespace gpureg::io::scans
