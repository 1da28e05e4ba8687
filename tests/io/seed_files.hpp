// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <cstring>
#include <string>
#include <vector>

/// Small files of every kind that the readers know: what mutations start from.
namespace gpureg::test {

enum class Reader : std::uint8_t { point_cloud, log, information, cameras, pairs };
inline constexpr int kReaders = 5;

struct SeedFile {
  Reader reader;
  std::string content;
};

/// The bytes of a number, in that order.
template <typename T>
std::string raw(T value, bool big_endian = false) {
  std::string bytes(sizeof(T), '\0');
  std::memcpy(bytes.data(), &value, sizeof(T));
  return big_endian ? std::string(bytes.rbegin(), bytes.rend()) : bytes;
}

/// count points (k, k + 0.25, -k) with normal (0, 0, 1), big endian or not, T = float or double.
template <typename T>
std::string raw_points(int count, bool big_endian, bool normals) {
  std::string bytes;
  for (int k = 0; k < count; ++k) {
    for (const T v : {T(k), T(k + 0.25), T(-k)}) bytes += raw(v, big_endian);
    if (normals)
      for (const T v : {T(0), T(0), T(1)}) bytes += raw(v, big_endian);
  }
  return bytes;
}

inline std::string ply_header(const std::string& format, int count, const std::string& type,
                              bool normals) {
  std::string header =
      "ply\nformat " + format + " 1.0\nelement vertex " + std::to_string(count) + "\n";
  for (const char* name : {"x", "y", "z"}) header += "property " + type + " " + name + "\n";
  if (normals)
    for (const char* name : {"nx", "ny", "nz"}) header += "property " + type + " " + name + "\n";
  return header;
}

inline std::string replaced(std::string text, const std::string& from, const std::string& to) {
  return text.replace(text.find(from), from.size(), to);
}

inline std::string pcd_header(int count, const std::string& data) {
  const std::string n = std::to_string(count);
  return "# .PCD v0.7 - Point Cloud Data file format\nVERSION 0.7\nFIELDS x y z\nSIZE 4 4 4\nTYPE "
         "F F F\nCOUNT 1 1 1\nWIDTH " +
         n + "\nHEIGHT 1\nVIEWPOINT 0 0 0 1 0 0 0\nPOINTS " + n + "\nDATA " + data + "\n";
}

/// LZF without a single repetition: runs of at most 32 literal bytes.
inline std::string pack_literally(const std::string& bytes) {
  std::string packed;
  for (std::size_t at = 0; at < bytes.size(); at += 32) {
    const std::string run = bytes.substr(at, 32);
    packed += static_cast<char>(run.size() - 1) + run;
  }
  return packed;
}

inline std::vector<SeedFile> seed_files() {
  std::vector<SeedFile> seeds;
  const auto cloud = [&](const std::string& content) {
    seeds.push_back({Reader::point_cloud, content});
  };
  cloud(ply_header("ascii", 3, "float", false) + "end_header\n0 0 0\n1 2.5 -3e-2\nnan inf -inf\n");
  cloud(ply_header("binary_little_endian", 4, "float", true) + "end_header\n" +
        raw_points<float>(4, false, true));
  cloud(ply_header("binary_big_endian", 4, "double", false) + "end_header\n" +
        raw_points<double>(4, true, false));
  cloud(ply_header("binary_little_endian", 3, "float", false) +
        "comment a mesh\nelement face 1\nproperty list uchar int vertex_indices\nend_header\n" +
        raw_points<float>(3, false, false) + "\3" + raw(0) + raw(1) + raw(2));
  cloud(
      "ply\r\nformat ascii 1.0\r\nelement face 1\r\nproperty list uchar int i\r\nelement vertex "
      "1\r\nproperty uchar red\r\n"
      "property float x\r\nproperty float y\r\nproperty float z\r\nend_header\r\n3 0 0 0\r\n255 1 "
      "2 3\r\n");
  cloud(pcd_header(2, "ascii") + "1 2 3\n4 5 6\n");
  cloud(pcd_header(4, "binary") + raw_points<float>(4, false, false));
  const std::string packed = pack_literally(raw_points<float>(4, false, false));
  cloud(pcd_header(4, "binary_compressed") + raw(static_cast<std::uint32_t>(packed.size())) +
        raw(std::uint32_t{48}) + packed);
  // Two points of 12 zero bytes each: one literal byte, then a repetition of 23 bytes.
  cloud(pcd_header(2, "binary_compressed") + raw(std::uint32_t{5}) + raw(std::uint32_t{24}) +
        std::string("\x00\x00\xe0\x0e\x00", 5));
  cloud(ply_header("binary_little_endian", 2, "float", false) +
        "property list uchar int view\nend_header\n" + raw_points<float>(1, false, false) + "\1" +
        raw(7) + raw_points<float>(1, false, false) + std::string(1, '\0'));
  cloud("//X Y Z Nx Ny Nz\n2\n1 2 3 0 0 1\n4 -1.#IND 6 0 1 0\n");
  cloud("sep=;\nt;x;\"y\";z [m]\n0;1.5;;-3e2\n1;4;5;6\n");
  cloud("2\n1 2 3 -120 1 2 3\n4 5 6 9 1 2 3\n");
  cloud(
      "1\n2\n1 2 3\n1 0 0\n0 1 0\n0 0 1\n1 0 0 0\n0 1 0 0\n0 0 1 0\n1 2 3 1\n1 2 3 0.5\n0 0 0 "
      "0.5\n");
  cloud("CNOFF\n# points\n2 0 0\n1 2 3 0 0 1 9 9 9\n4 5 6 0 1 0 9 9 9\n");
  seeds.push_back({Reader::log, "0\t 2\t 57\n1 0 0 0.5\n0 1 0 0\n0 0 1 -1e-3\n0 0 0 1\n"});
  seeds.push_back(
      {Reader::information,
       "0 2 57\n9 0 0 0 0 0\n0 9 0 0 0 0\n0 0 9 0 0 0\n0 0 0 1 0 0\n0 0 0 0 1 0\n0 0 0 0 0 1.5\n"});
  seeds.push_back(
      {Reader::cameras, "# fragment frame t q\n0 0 0.1 0.2 0.3 0 0 0 1\n0 1 1 2 3 0.6 0 0.8 0\n"});
  seeds.push_back({Reader::pairs, "0 1 # first\n\n2 5\n"});
  return seeds;
}

}  // namespace gpureg::test
