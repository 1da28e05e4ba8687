// SPDX-License-Identifier: BSD-3-Clause
#include <cmath>

#include "files/text_file.hpp"
#include "gpureg/io.hpp"
#include "io/scans/word.hpp"

namespace gpureg::io {

std::map<int, std::vector<Eigen::Vector3d>> read_cameras(const std::string& path,
                                                         const std::vector<ScanFile>& scans) {
  constexpr std::size_t kFields = 9;
  std::map<int, std::vector<Eigen::Vector3d>> cameras;
  files::TextFile file(path, '#');
  while (file.next()) {
    const std::size_t count = file.fields().size();
    // A name may have blanks.
    const bool named = count >= kFields && !scans.empty() && !scans::is_digits(file.fields()[0]);
    if (count < kFields || (count > kFields && !named))
      file.fail("a camera has " + std::to_string(count) +
                " fields, expected 9: fragment frame tx ty tz qx qy qz qw");
    const std::size_t frame = count - kFields + 1;
    const auto scan = named ? find_scan(scans, scans::words(file, 0, frame)) : std::nullopt;
    const int fragment = !named ? file.index(0, "fragment") : scan ? scans[*scan].number : -1;
    file.index(frame, "frame");
    const Eigen::Vector3d position(file.number(frame + 1, "tx"), file.number(frame + 2, "ty"),
                                   file.number(frame + 3, "tz"));
    if (!position.cast<float>().allFinite())
      file.fail("the camera is farther away than a float can tell");
    const Eigen::Vector4d q(file.number(frame + 4, "qx"), file.number(frame + 5, "qy"),
                            file.number(frame + 6, "qz"), file.number(frame + 7, "qw"));
    // Six digits leave 1e-6; the bound only detects columns that are no quaternion.
    constexpr double kNormTolerance = 1e-3;
    if (std::abs(q.norm() - 1) > kNormTolerance)
      file.fail("the quaternion has length " + std::to_string(q.norm()) + ", expected 1");
    // The cameras of a larger set serve a part of it.
    if (fragment >= 0) cameras[fragment].push_back(position);
  }
  return cameras;
}

}  // namespace gpureg::io
