// SPDX-License-Identifier: BSD-3-Clause
#include "records/fragments_json.hpp"

#include "json/fields_json.hpp"
#include "json/json.hpp"
#include "text.hpp"

namespace gpureg::cli {

std::string unusable_line(const FragmentFolder& folder) {
  std::string line;
  for (const UnusableFragment& fragment : folder.unusable)
    line += (line.empty() ? " " : ", ") + label(fragment.scan);
  return line.empty() ? "" : "unusable  " + line + "\n";
}

Json unusable_json(const FragmentFolder& folder) {
  Json unusable = Json::array();
  for (const UnusableFragment& fragment : folder.unusable)
    unusable.push_back({{"number", fragment.scan.number},
                        {"name", fragment.scan.name},
                        {"file", base_name(fragment.scan.path)},
                        {"reason", fragment.reason}});
  return unusable;
}

Json fragments_json(const FragmentFolder& folder, const std::vector<PreparedCloud>& clouds) {
  Json fragments = Json::array();
  for (std::size_t k = 0; k < folder.numbers.size(); ++k) {
    Json fragment = {{"number", folder.numbers[k]},
                     {"name", folder.scans[k].name},
                     {"file", base_name(folder.scans[k].path)}};
    fragment.update(to_json(clouds[k].statistics()));
    fragments.push_back(std::move(fragment));
  }
  return fragments;
}

}  // namespace gpureg::cli
