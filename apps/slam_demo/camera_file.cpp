// SPDX-License-Identifier: BSD-3-Clause
#include "camera_file.hpp"

#include <gpureg/error.hpp>
#include <opencv2/core/eigen.hpp>

namespace slam_demo {
namespace {

using gpureg::IoError;

/// The matrix of an entry as doubles; empty where the file has none.
cv::Mat1d matrix_of(const cv::FileStorage& file, const std::string& path, const char* name,
                    int rows, int columns) {
  const cv::FileNode node = file[name];
  if (node.empty()) return {};
  cv::Mat stored;
  node >> stored;
  cv::Mat1d matrix;
  if (!stored.empty()) stored.convertTo(matrix, CV_64F);
  if (rows > 0 && (matrix.rows != rows || matrix.cols != columns))
    throw IoError(path + ": " + name + " needs " + std::to_string(rows) + " x " +
                  std::to_string(columns) + " numbers");
  if (matrix.empty() || !cv::checkRange(matrix))
    throw IoError(path + ": " + name + " has no finite numbers");
  return matrix;
}

Pinhole pinhole_of(const cv::Mat1d& k, const std::string& path, const char* name) {
  if (!(k(0, 0) > 0) || k(1, 1) == 0) throw IoError(path + ": " + name + " has no focal length");
  return {k(0, 0), k(1, 1), k(0, 2), k(1, 2)};
}

void read(const cv::FileStorage& file, const std::string& path, Rig& rig) {
  const int width = static_cast<int>(file["image_width"].real()),
            height = static_cast<int>(file["image_height"].real());
  if (width < 2 || height < 2) throw IoError(path + ": needs image_width and image_height");
  const cv::Mat1d k = matrix_of(file, path, "camera_matrix", 3, 3);
  if (k.empty()) throw IoError(path + ": has no camera_matrix");
  const cv::Mat1d distortion = matrix_of(file, path, "distortion_coefficients", 0, 0);
  if (!distortion.empty() && distortion.total() != 4 && distortion.total() != 5 &&
      distortion.total() != 8)
    throw IoError(path + ": distortion_coefficients needs 4, 5 or 8 numbers");
  set_camera(pinhole_of(k, path, "camera_matrix"), distortion, {width, height}, rig);
  if (!file["depth_units"].empty()) rig.depth_units = file["depth_units"].real();
  if (!(rig.depth_units > 0)) throw IoError(path + ": depth_units needs to be > 0");
  const cv::Mat1d depth = matrix_of(file, path, "depth_camera_matrix", 3, 3);
  if (depth.empty()) return;
  rig.depth = pinhole_of(depth, path, "depth_camera_matrix");
  if (rig.depth.fy < 0 || rig.flipped)
    throw IoError(path + ": depth that is not registered needs focal lengths > 0");
  rig.registered = false;
  const cv::Mat1d motion = matrix_of(file, path, "colour_from_depth", 4, 4);
  if (motion.empty()) return;
  Eigen::Matrix4d m;
  cv::cv2eigen(motion, m);
  rig.colour_from_depth.linear() =
      Eigen::Quaterniond(Eigen::Matrix3d(m.topLeftCorner<3, 3>())).normalized().toRotationMatrix();
  rig.colour_from_depth.translation() = m.topRightCorner<3, 1>();
}

}  // namespace

void read_camera(const std::string& path, Rig& rig) {
  try {
    const cv::FileStorage file(path, cv::FileStorage::READ);
    if (!file.isOpened()) throw IoError(path + ": cannot be read");
    read(file, path, rig);
  } catch (const cv::Exception&) {
    throw IoError(path + ": is no file of OpenCV's FileStorage (YAML, XML or JSON)");
  }
}

}  // namespace slam_demo
