// SPDX-License-Identifier: BSD-3-Clause
#include "io/clouds/e57.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <fstream>
#include <map>
#include <optional>

#include "files/text_file.hpp"
#include "io/decode.hpp"
#include "io/source.hpp"

namespace gpureg::io {
namespace {

constexpr std::size_t kFileHeader = 48;
constexpr std::size_t kChecksum = 4;  ///< bytes at the end of every page
constexpr std::size_t kMostXml = std::size_t{1} << 28;
constexpr std::size_t kLeastPage = 64, kMostPage = std::size_t{1} << 20;

/// The XML of a file, without the checksums of its pages.
std::string xml_of(const std::string& path) {
  const std::string header = files::read_start(path, kFileHeader);
  const Source source(path, header);
  if (header.size() < kFileHeader) source.fail("truncated: the header of an E57 file is missing");
  const bool swap = host_order() != ByteOrder::little;
  const auto field = [&](std::size_t at) {
    // double does not hold all integers of 64 bits.
    const auto half = [&](std::size_t k) {
      return static_cast<std::uint64_t>(load(Scalar::uint32, header.data() + at + k, swap));
    };
    return half(0) | half(4) << 32;
  };
  const std::uint64_t begin = field(24), length = field(32), page = field(40);
  std::ifstream file(path, std::ios::binary | std::ios::ate);
  const auto size = static_cast<std::uint64_t>(file.tellg());
  if (page < kLeastPage || page > kMostPage || begin >= size || length > kMostXml ||
      length > size - begin)
    source.fail("truncated, or damaged: its list of scans is not in the file");
  file.seekg(static_cast<std::streamoff>(begin));
  std::string xml, piece;
  for (std::uint64_t at = begin; xml.size() < length;) {
    const std::uint64_t end_of_data = (at / page + 1) * page - kChecksum;
    if (at >= end_of_data) source.fail("damaged: its list of scans begins in a checksum");
    piece.resize(std::min<std::uint64_t>(end_of_data - at, length - xml.size()));
    if (!file.read(piece.data(), static_cast<std::streamsize>(piece.size())))
      source.fail("truncated: its list of scans is not in the file");
    xml += piece;
    at = end_of_data + kChecksum;
    file.ignore(kChecksum);
  }
  return xml;
}

std::string unescaped(std::string_view text) {
  static constexpr std::pair<std::string_view, char> kNames[] = {
      {"&lt;", '<'}, {"&gt;", '>'}, {"&amp;", '&'}, {"&quot;", '"'}, {"&apos;", '\''}};
  std::string out;
  while (!text.empty()) {
    std::size_t length = 1;
    char c = text[0];
    for (const auto& [name, meant] : kNames)
      if (text.substr(0, name.size()) == name) {
        length = name.size();
        c = meant;
      }
    out += static_cast<unsigned char>(c) < ' ' ? ' ' : c;
    text.remove_prefix(length);
  }
  return out;
}

/// Walks the tags of an XML text. E57 writes one structure per level, and CDATA around names.
class Walker {
 public:
  explicit Walker(std::string_view xml) : rest_(xml) {}

  std::string tag;         ///< of the element that begins or ends
  std::string attributes;  ///< of one that begins
  bool begins = false, ends = false;
  std::string text;  ///< in front of the tag

  bool next() {
    text.clear();
    for (;;) {
      const std::size_t open = rest_.find('<');
      if (open == rest_.npos) return false;
      text += unescaped(rest_.substr(0, open));
      rest_.remove_prefix(open);
      if (skip("<![CDATA[", "]]>", &text) || skip("<!--", "-->", nullptr) ||
          skip("<?", "?>", nullptr))
        continue;
      const std::size_t close = rest_.find('>');
      if (close == rest_.npos) return false;
      take(rest_.substr(1, close - 1));
      rest_.remove_prefix(close + 1);
      return true;
    }
  }

 private:
  bool skip(std::string_view begin, std::string_view end, std::string* content) {
    if (rest_.substr(0, begin.size()) != begin) return false;
    const std::size_t stop = std::min(rest_.find(end, begin.size()), rest_.size());
    if (content != nullptr) *content += rest_.substr(begin.size(), stop - begin.size());
    rest_.remove_prefix(std::min(stop + end.size(), rest_.size()));
    return true;
  }

  void take(std::string_view inside) {
    begins = inside.empty() || inside.front() != '/';
    ends = !begins || inside.back() == '/';
    if (!begins) inside.remove_prefix(1);
    if (begins && ends) inside.remove_suffix(1);
    const std::size_t length = std::min(inside.find_first_of(" \t\r\n"), inside.size());
    tag = inside.substr(0, length);
    attributes = inside.substr(length);
  }

  std::string_view rest_;
};

std::size_t count_in(const std::string& attributes) {
  const std::size_t at = attributes.find("recordCount=\"");
  if (at == std::string::npos) return 0;
  const std::string_view number = std::string_view(attributes).substr(at + 13);
  std::size_t count = 0;
  return parse_count(number.substr(0, number.find('"')), count) ? count : 0;
}

std::optional<StoredScan::Pose> pose_of(const std::map<std::string, double>& numbers) {
  const auto at = [&](const char* name, double otherwise) {
    const auto found = numbers.find(name);
    return found == numbers.end() ? otherwise : found->second;
  };
  if (numbers.empty()) return std::nullopt;
  Eigen::Quaterniond q(at("rotation/w", 1), at("rotation/x", 0), at("rotation/y", 0),
                       at("rotation/z", 0));
  const Eigen::Vector3d t(at("translation/x", 0), at("translation/y", 0), at("translation/z", 0));
  if (!(q.norm() > 0.9 && q.norm() < 1.1) || !t.allFinite()) return std::nullopt;
  StoredScan::Pose pose = StoredScan::Pose::Identity();
  pose.topLeftCorner<3, 3>() = q.normalized().toRotationMatrix();
  pose.topRightCorner<3, 1>() = t;
  return pose;
}

}  // namespace

bool looks_like_e57(std::string_view start) { return start.substr(0, 8) == "ASTM-E57"; }

std::vector<StoredScan> index_e57(const std::string& path) {
  const std::string xml = xml_of(path);
  Walker walker(xml);
  std::vector<std::string> open;
  std::vector<StoredScan> scans;
  std::map<std::string, double> pose;
  const auto is_scan = [&](std::size_t depth) {
    return open.size() == depth && open[0] == "e57Root" && open[1] == "data3D" &&
           open[2] == "vectorChild";
  };
  while (walker.next()) {
    if (walker.begins) {
      open.push_back(walker.tag);
      if (is_scan(3)) {
        scans.emplace_back();
        pose.clear();
      }
      if (is_scan(4) && walker.tag == "points") scans.back().points = count_in(walker.attributes);
    }
    if (!walker.ends) continue;
    if (open.empty() || open.back() != walker.tag)
      Source(path, "").fail("damaged: its list of scans has a wrong tag " +
                            files::in_quotes(walker.tag));
    if (is_scan(4) && walker.tag == "name") scans.back().name = walker.text;
    if (is_scan(6) && open[3] == "pose") {
      const std::string name = open[4] + "/" + open[5];
      double number = 0;
      // An empty element is 0.
      if (walker.begins || parse_coordinate(walker.text, number)) pose[name] = number;
    }
    if (is_scan(4) && walker.tag == "pose") scans.back().file_from_scan = pose_of(pose);
    open.pop_back();
  }
  return scans;
}

}  // namespace gpureg::io
