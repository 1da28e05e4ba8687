// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>
#include <vector>

/// The descriptions of fields as text, for the type stubs of Python and the tables of the
/// documentation.
namespace gpureg::fields {

struct FieldText {
  std::string name, sentence;
  std::string type;   ///< in Python
  std::string value;  ///< the default; empty for a group
  std::string range;  ///< unit, interval or names; empty where there is none
};

struct StructText {
  std::string name, sentence;
  bool options = false;  ///< callers fill it in; otherwise the library does
  std::vector<FieldText> fields;
};

/// Every described struct.
std::vector<StructText> all_structs();

}  // namespace gpureg::fields
