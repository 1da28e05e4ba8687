// SPDX-License-Identifier: BSD-3-Clause
// Writes the descriptions of fields into files that have a place for them:
//   gpureg_fields [--check] FILE...
// In Markdown, a table between "<!-- options NAME -->" and "<!-- end of options -->"; in a type
// stub, the members of a class between "# fields of NAME" and "# end of fields".
// --check: nothing is written; exit status 1 where a file would change.
#include <cstdio>
#include <fstream>
#include <iterator>
#include <string>
#include <utility>

#include "fields/describe.hpp"

namespace {

using gpureg::fields::FieldText;
using gpureg::fields::StructText;

// A field without a default is a struct, which has a table of its own.
std::string table(const StructText& text) {
  std::string out = "| field | default; range | meaning |\n| --- | --- | --- |\n";
  for (const FieldText& f : text.fields)
    if (!f.value.empty())
      out += "| `" + f.name + "` | " + f.value + (f.range.empty() ? "" : "; ") + f.range + " | " +
             f.sentence + " |\n";
  return out;
}

std::string keywords(const StructText& text) {
  std::string out = "        self,\n        *,\n";
  for (const FieldText& f : text.fields) out += "        " + f.name + ": " + f.type + " = ...,\n";
  return out;
}

std::string options_stub(const StructText& text) {
  std::string out;
  for (const FieldText& f : text.fields) out += "    " + f.name + ": " + f.type + "\n";
  return out + "    def __init__(\n" + keywords(text) + "    ) -> None: ...\n    def replace(\n" +
         keywords(text) + "    ) -> " + text.name + ": ...\n    def validate(self) -> None: ...\n";
}

std::string record_stub(const StructText& text) {
  std::string out;
  for (const FieldText& f : text.fields)
    out += "    @property\n    def " + f.name + "(self) -> " + f.type + ": ...\n";
  return out;
}

std::string stub(const StructText& text) {
  return (text.options ? options_stub(text) : record_stub(text)) +
         "    def __eq__(self, other: object, /) -> bool: ...\n"
         "    __hash__: None  # type: ignore[assignment]\n"
         "    _fields: tuple[str, ...]\n";
}

/// Replaces what stands between `begin` NAME `end_of_begin` and `end`, whole lines.
void fill(std::string& file, const std::string& begin, const std::string& end,
          const std::string& text) {
  for (std::size_t at = file.find(begin); at != std::string::npos; at = file.find(begin, at + 1)) {
    const std::size_t first = at + begin.size(), last = file.find(end, first);
    if (last == std::string::npos) return;
    file.replace(first, last - first, text);
  }
}

std::string filled(std::string file) {
  for (const StructText& text : gpureg::fields::all_structs()) {
    fill(file, "<!-- options " + text.name + " -->\n", "<!-- end of options -->", table(text));
    fill(file, "    # fields of " + text.name + "\n", "    # end of fields", stub(text));
  }
  return file;
}

std::string read(const std::string& path) {
  std::ifstream file(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(file), std::istreambuf_iterator<char>()};
}

}  // namespace

int main(int argc, char** argv) {
  int status = 0;
  const bool check = argc > 1 && std::string(argv[1]) == "--check";
  for (int k = check ? 2 : 1; k < argc; ++k) {
    const std::string before = read(argv[k]), after = filled(before);
    if (before.empty()) {
      std::fprintf(stderr, "gpureg_fields: %s: empty, or not there\n", argv[k]);
      return 2;
    }
    if (after == before) continue;
    if (check)
      std::fprintf(stderr, "gpureg_fields: %s is not what the fields say: run gpureg_fields %s\n",
                   argv[k], argv[k]);
    else
      std::ofstream(argv[k], std::ios::binary) << after;
    status = check ? 1 : 0;
  }
  return status;
}
