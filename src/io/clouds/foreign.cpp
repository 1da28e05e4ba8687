// SPDX-License-Identifier: BSD-3-Clause
#include "io/clouds/foreign.hpp"

#include <algorithm>

#include "io/extension.hpp"

namespace gpureg::io {
namespace {

using namespace std::string_view_literals;

constexpr std::string_view kFormats =
    ", which the library itself does not read; the command `gpureg` and Python do, after: pip "
    "install 'gpureg[formats]'";

struct Kind {
  std::string_view sentence;
  std::string_view start;       ///< first bytes, one of those between bars
  std::string_view extensions;  ///< each between blanks
};

constexpr std::string_view kCompressed = "compressed: unpack it first";
constexpr std::string_view kRecording =
    "a recording of sensor messages: extract its clouds first, as examples/python/14_bag.py does "
    "with the package rosbags";
constexpr std::string_view kPackets =
    "a recording of a sensor's packets: export its frames as PCD or CSV with the sensor's program";
constexpr std::string_view kImage =
    "an image: of a depth image, gpureg.from_depth_image (Python) makes a cloud; read the image "
    "with Pillow or OpenCV";
constexpr std::string_view kModel =
    "a model in a format that is not read: convert it to PLY, STL or OBJ, with MeshLab, Blender or "
    "trimesh";
constexpr std::string_view kCad =
    "a CAD model without triangles: export it as STL or OBJ from a CAD program, as FreeCAD";
constexpr std::string_view kScanner =
    "a project of a scanner's own program: export it as E57, PTX or PLY there";
constexpr std::string_view kArrays =
    "arrays of numbers: load them in Python, and give gpureg the (N, 3) array of coordinates";
constexpr std::string_view kPage = "a web page: the download failed; fetch the file itself";
constexpr std::string_view kUtf16 = "text in UTF-16: save it as UTF-8 or ASCII";

// Bytes first, as they do not lie; starts of fewer than four bytes would meet numbers.
constexpr Kind kByBytes[] = {
    {"a Git LFS pointer, not the file that it stands for: run `git lfs pull`",
     "version https://git-lfs", ""},
    {kPage, "<!DOCTYPE html", ""},
    {kPage, "<!doctype html", ""},
    {kPage, "<html", ""},
    {kPage, "<HTML", ""},
    {kModel, "glTF", ""},
    {kCad, "ISO-10303-21", ""},
    {kModel, "Kaydara FBX", ""},
    {kModel, "BLENDER", ""},
    {kModel, "PXR-USDC", ""},
    {kModel, "#VRML", ""},
    {kModel, "DRACO", ""},
    {kArrays, "\x93NUMPY", ""},
    {kArrays, "\x89HDF\r\n", ""},
    {kArrays, "MATLAB 5.0", ""},
    {kRecording, "#ROSBAG V", ""},
    {kRecording, "\x89MCAP0", ""},
    {kRecording, "SQLite format 3", ""},
    {kPackets, "\xD4\xC3\xB2\xA1", ""},
    {kPackets, "\x0A\x0D\x0D\x0A", ""},
    {kImage, "\x89PNG", ""},
    {kImage, "\xFF\xD8\xFF\xE0", ""},
    {kImage, "\xFF\xD8\xFF\xE1", ""},
    {kImage, "II*\0"sv, ""},
    {kImage, "MM\0*"sv, ""},
    {kImage, "\x76\x2F\x31\x01", ""},
    {kCompressed, "\x1F\x8B\x08\0"sv, ""},
    {kCompressed, "\x1F\x8B\x08\x08", ""},
    {kCompressed, "BZh9", ""},
    {kCompressed, "\xFD\x37zXZ", ""},
    {kCompressed, "7z\xBC\xAF", ""},
    {kCompressed, "Rar!", ""},
    {kCompressed, "\x28\xB5\x2F\xFD", ""},
};

constexpr Kind kByName[] = {
    {kArrays, "", " .npy .npz .h5 .hdf5 .mat .pkl .pt .pth .parquet "},
    {kModel, "",
     " .gltf .glb .fbx .dae .3ds .3mf .blend .usd .usda .usdc .usdz .wrl .vrml .x3d .drc .ctm .vtk "
     ".vtp .vtu "},
    {kCad, "", " .step .stp .iges .igs .sat .brep .sldprt .ifc .dwg .dxf "},
    {kScanner, "", " .rcp .rcs .fls .fws .zfs .zfprj .rdb .rdbx .rxp .ptg .imp .lsproj .tzf .rwp "},
    {kRecording, "", " .bag .mcap .db3 "},
    {kPackets, "", " .pcap .pcapng "},
    {kImage, "", " .png .jpg .jpeg .tif .tiff .exr .pgm .ppm .bmp .webp "},
    {"Gaussian splats in a format that is not read: export them as PLY", "",
     " .splat .spz .ksplat "},
    {kCompressed, "", " .zip .gz .tgz .tar .bz2 .xz .7z .rar .zst "},
};

}  // namespace

std::string foreign_format(const std::string& path, std::string_view start) {
  const std::string extension = extension_of(path);
  if (start.substr(0, 4) == "LASF" || extension == ".las" || extension == ".laz")
    return "a LAS file" + std::string(kFormats);
  if (start.substr(0, 8) == "ASTM-E57" || extension == ".e57")
    return "an E57 file" + std::string(kFormats);
  if (start.substr(0, 2) == "\xFF\xFE" || start.substr(0, 2) == "\xFE\xFF") {
    // Text, as numbers may begin so: every second byte is zero.
    const std::string_view text = start.substr(2, 64);
    std::size_t zeros = 0;
    for (const char c : text) zeros += c == '\0';
    if (2 * zeros + 4 > text.size() && 2 * zeros < text.size() + 4) return std::string(kUtf16);
  }
  if (start.substr(0, 4) == "PK\3\4" && extension != ".npz" && extension != ".3mf" &&
      extension != ".usdz" && extension != ".pt" && extension != ".pth")
    return std::string(kCompressed);
  std::string_view text = start.substr(0, 3) == "\xEF\xBB\xBF" ? start.substr(3) : start;
  text.remove_prefix(std::min(text.find_first_not_of(" \t\r\n"), text.size()));
  for (const Kind& kind : kByBytes)
    if (start.substr(0, kind.start.size()) == kind.start ||
        text.substr(0, kind.start.size()) == kind.start)
      return std::string(kind.sentence);
  const std::string name = " " + extension + " ";
  for (const Kind& kind : kByName)
    if (!extension.empty() && kind.extensions.find(name) != kind.extensions.npos)
      return std::string(kind.sentence);
  return {};
}

}  // namespace gpureg::io
