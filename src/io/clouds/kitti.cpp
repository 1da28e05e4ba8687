// SPDX-License-Identifier: BSD-3-Clause
#include "io/clouds/kitti.hpp"

#include <cstddef>
#include <string>
#include <vector>

#include "io/clouds/row_width.hpp"
#include "io/decode.hpp"
#include "io/extension.hpp"

namespace gpureg::io {
namespace {

/// No scanner reaches farther, in metres; other data read as floats mostly does.
constexpr float kMostDistant = 1e5f;
/// Of fewer rows the distributions of the columns tell nothing.
constexpr std::size_t kFewRows = 64;
constexpr std::size_t kKitti = 4, kNuScenes = 5;

/// Numbers in a row. Sizes alone do not tell: a scan of nuScenes may be of a size that is one of
/// KITTI, and would be another scene.
std::size_t width_of(const std::vector<float>& numbers, const Source& source) {
  const bool kitti = numbers.size() % kKitti == 0;
  const bool few = numbers.size() < kFewRows * kKitti;
  const auto width = few ? kKitti : static_cast<std::size_t>(row_width(numbers));
  if (width >= 3 && width <= 6 && numbers.size() % width == 0) return width;
  const std::string bytes = std::to_string(sizeof(float) * numbers.size()) + " bytes";
  const std::string expected =
      "expected rows of 16 bytes, x y z reflectance, or of 20 bytes, as of nuScenes";
  if (width > 0 && !few)
    source.fail("no scan of KITTI: the numbers look like rows of " + std::to_string(width) +
                (numbers.size() % width == 0 ? "" : ", whose size does not divide " + bytes) +
                "; " + expected);
  if (!kitti) source.fail(bytes + " are no scan of KITTI: " + expected);
  source.fail("no scan of KITTI: the numbers do not look like rows of coordinates and another one");
}

}  // namespace

bool looks_like_kitti(const std::string& path) { return extension_of(path) == ".bin"; }

PointCloud read_kitti(Source& source) {
  const std::string_view bytes = source.rest();
  if (bytes.size() % sizeof(float) != 0)
    source.fail(std::to_string(bytes.size()) +
                " bytes are no scan of KITTI: expected rows of 16 bytes, x y z reflectance");
  const bool swap = host_order() != ByteOrder::little;
  std::vector<float> numbers;
  numbers.reserve(bytes.size() / sizeof(float));
  for (std::size_t at = 0; at < bytes.size(); at += sizeof(float))
    numbers.push_back(static_cast<float>(load(Scalar::float32, bytes.data() + at, swap)));
  const std::size_t width = width_of(numbers, source);
  PointCloud cloud;
  cloud.points.reserve(numbers.size() / width);
  std::size_t strange = 0, negative = 0;
  for (std::size_t k = 0; k < numbers.size(); k += width) {
    cloud.points.emplace_back(numbers[k], numbers[k + 1], numbers[k + 2]);
    strange += !(cloud.points.back().cwiseAbs().maxCoeff() <= kMostDistant);
    negative += width == kNuScenes && numbers[k + 3] < 0;
  }
  if (2 * strange > cloud.points.size())
    source.fail("no scan of KITTI: " + std::to_string(strange) + " of " +
                std::to_string(cloud.points.size()) + " rows are no coordinates");
  if (negative > 0)
    source.fail("no scan of nuScenes: rows of five numbers, but " + std::to_string(negative) +
                " intensities are negative");
  source.skip(bytes.size());
  return cloud;
}

}  // namespace gpureg::io
