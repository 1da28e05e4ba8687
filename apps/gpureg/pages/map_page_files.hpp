// SPDX-License-Identifier: BSD-3-Clause
#pragma once

namespace gpureg::cli {

/// The files map_page.html and map_page.js, embedded by CMake.
extern const char* const kMapPageHtml;
extern const char* const kMapPageScript;

}  // namespace gpureg::cli
