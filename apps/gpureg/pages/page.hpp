// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>

#include "json/json_fwd.hpp"

/// Pages of one file, without network: a template of HTML, a script that draws, and data as JSON.
namespace gpureg::cli {

/// A template and its script, embedded by CMake.
struct PageFiles {
  const char *html, *script;
};
extern const PageFiles kMapPage, kReportPage;

/// The page, with its marks {{title}}, {{script}} and {{data}} replaced.
std::string filled(const PageFiles& files, const std::string& title, const Json& data);

/// Replaces the characters that HTML reserves.
std::string escaped(const std::string& text);

/// RFC 4648, with padding.
std::string base64(const std::string& bytes);

}  // namespace gpureg::cli
