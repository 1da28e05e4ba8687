// SPDX-License-Identifier: BSD-3-Clause
#include "pages/page.hpp"

#include <cstdint>
#include <map>

#include "json/json.hpp"

namespace gpureg::cli {

std::string filled(const PageFiles& files, const std::string& title, const Json& data) {
  std::string text = data.dump();
  // Nothing in the data may end the element that holds it.
  for (std::size_t at = 0; (at = text.find('<', at)) != std::string::npos;)
    text.replace(at, 1, "\\u003c");
  const std::map<std::string, std::string> values = {
      {"title", escaped(title)}, {"script", files.script}, {"data", text}};
  const std::string page = files.html;
  std::string out;
  // What comes in may look like a mark itself.
  for (std::size_t at = 0;;) {
    const std::size_t mark = page.find("{{", at);
    out += page.substr(at, mark - at);
    if (mark == std::string::npos) return out;
    const std::size_t end = page.find("}}", mark);
    out += values.at(page.substr(mark + 2, end - mark - 2));
    at = end + 2;
  }
}

std::string escaped(const std::string& text) {
  static const std::map<char, std::string> names = {
      {'&', "&amp;"}, {'<', "&lt;"}, {'>', "&gt;"}, {'"', "&quot;"}};
  std::string safe;
  for (const char c : text) {
    const auto found = names.find(c);
    safe += found == names.end() ? std::string(1, c) : found->second;
  }
  return safe;
}

std::string base64(const std::string& bytes) {
  static constexpr char kDigits[] =
      "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  std::string text;
  text.reserve((bytes.size() + 2) / 3 * 4);
  for (std::size_t k = 0; k < bytes.size(); k += 3) {
    std::uint32_t word = 0;
    for (std::size_t n = 0; n < 3; ++n)
      word = word << 8 | (k + n < bytes.size() ? static_cast<unsigned char>(bytes[k + n]) : 0u);
    for (std::size_t n = 0; n < 4; ++n)
      text += k + n > bytes.size() ? '=' : kDigits[word >> (18 - 6 * n) & 63];
  }
  return text;
}

}  // namespace gpureg::cli
