// SPDX-License-Identifier: BSD-3-Clause
#include "option_names.hpp"

#include <array>
#include <cctype>
#include <utility>

namespace gpureg::cli {
namespace {

VoxelSizeOrigin& voxel_size_origin() {
  static VoxelSizeOrigin origin = VoxelSizeOrigin::given;
  return origin;
}

std::string voxel_size_option() {
  return voxel_size_origin() == VoxelSizeOrigin::automatic ? "--voxel-size (auto)" : "--voxel-size";
}

/// Part of a longer name, of a path or of a quotation.
bool joins(char c) {
  return std::isalnum(static_cast<unsigned char>(c)) != 0 || c == '_' || c == '.' || c == '/' ||
         c == '-' || c == '"' || c == '\'' || c == '=';
}

void replace(std::string& text, const std::string& name, const std::string& option) {
  for (std::size_t at = 0; (at = text.find(name, at)) != std::string::npos;) {
    const std::size_t end = at + name.size();
    const bool ends = end == text.size() || !joins(text[end]) ||
                      (text[end] == '.' && (end + 1 == text.size() || text[end + 1] == ' '));
    if (ends && (at == 0 || !joins(text[at - 1]))) {
      text.replace(at, name.size(), option);
      at += option.size();
    } else {
      at = end;
    }
  }
}

}  // namespace

void set_voxel_size_origin(VoxelSizeOrigin origin) { voxel_size_origin() = origin; }

std::string in_option_names(std::string message) {
  if (message.rfind("--set ", 0) == 0) return message;  // it lists fields
  const std::array<std::pair<const char*, std::string>, 7> names{{
      {"suggest_voxel_size()", "--voxel-size auto"},
      {"voxel_size", voxel_size_option()},
      {"min_confidence", "--min-confidence"},
      {"accept_symmetry", "--set accept_symmetry=true"},
      {"loop_consistency()", "`gpureg consistency`"},
      {"find()", "`gpureg find`"},
      {"a RegistrationPrior", "--up"},
  }};
  for (const auto& [name, option] : names) replace(message, name, option);
  return message;
}

}  // namespace gpureg::cli
