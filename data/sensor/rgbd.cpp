// SPDX-License-Identifier: BSD-3-Clause
#include "data/sensor/rgbd.hpp"

#include <png.h>

#include <algorithm>
#include <cmath>
#include <csetjmp>
#include <cstdio>

#include "data/random.hpp"
#include "data/rooms/texture.hpp"
#include "data/scene_files.hpp"
#include "gpureg/error.hpp"
#include "gpureg/files.hpp"

namespace gpureg::synthetic {
namespace {

using Eigen::Vector3f;

constexpr float kDepthUnits = 5000.0f;  // per metre

std::string timestamp(int frame) {
  char text[32];
  std::snprintf(text, sizeof(text), "%.6f", frame / camera::kFrameRate);
  return text;
}

void append_bytes(png_structp png, png_bytep data, png_size_t size) {
  bool failed = false;
  try {
    static_cast<std::string*>(png_get_io_ptr(png))
        ->append(reinterpret_cast<const char*>(data), size);
  } catch (const std::exception&) {
    failed = true;  // no exception may pass through libpng, which is C
  }
  if (failed) png_error(png, "out of memory");
}

/// A PNG in memory. rows: big-endian samples, as the format has them. An empty string where libpng
/// fails (it has no memory then).
std::string encode_png(const std::vector<std::uint8_t>& rows, int colour_type, int bit_depth) {
  std::string bytes;
  png_structp png = png_create_write_struct(PNG_LIBPNG_VER_STRING, nullptr, nullptr, nullptr);
  png_infop info = png != nullptr ? png_create_info_struct(png) : nullptr;
  if (info == nullptr || setjmp(png_jmpbuf(png)) != 0) {
    png_destroy_write_struct(&png, &info);
    return {};
  }
  png_set_write_fn(png, &bytes, append_bytes, nullptr);
  png_set_compression_level(png, 2);  // several times as fast as the default for a tenth more bytes
  png_set_IHDR(png, info, camera::kWidth, camera::kHeight, bit_depth, colour_type,
               PNG_INTERLACE_NONE, PNG_COMPRESSION_TYPE_DEFAULT, PNG_FILTER_TYPE_DEFAULT);
  png_write_info(png, info);
  const std::size_t stride = rows.size() / camera::kHeight;
  for (std::size_t row = 0; row < camera::kHeight; ++row)
    png_write_row(png, rows.data() + row * stride);
  png_write_end(png, info);
  png_destroy_write_struct(&png, &info);
  return bytes;
}

void write_png(const std::string& path, const std::vector<std::uint8_t>& rows, int colour_type,
               int bit_depth) {
  const std::string bytes = encode_png(rows, colour_type, bit_depth);
  if (bytes.empty()) throw IoError(path + ": the image cannot be encoded");
  files::write_atomically(path, bytes);
}

/// Linear light to an sRGB byte, near enough: gamma 2.2.
std::uint8_t to_byte(float linear, float noise) {
  return static_cast<std::uint8_t>(
      std::clamp(255.0f * std::pow(std::max(linear, 0.0f), 0.4545f) + noise + 0.5f, 0.0f, 255.0f));
}

}  // namespace

std::vector<std::uint8_t> render_colour(const RayScene& scene,
                                        const Eigen::Isometry3d& world_from_camera,
                                        std::uint64_t seed, int frame) {
  std::vector<std::uint8_t> image(static_cast<std::size_t>(camera::kWidth) * camera::kHeight * 3);
  const Eigen::Matrix3f rotation = world_from_camera.rotation().cast<float>();
  const Vector3f origin = world_from_camera.translation().cast<float>();
  const Vector3f daylight = Vector3f(0.4f, 0.3f, 0.85f).normalized();
  const std::uint64_t texture = hash_key(seed, Purpose::texture),
                      noise =
                          hash_key(seed, Purpose::texture, 1, static_cast<std::uint64_t>(frame));
  for (int y = 0; y < camera::kHeight; ++y) {
    for (int x = 0; x < camera::kWidth; ++x) {
      const auto pixel = static_cast<std::size_t>(y) * camera::kWidth + static_cast<std::size_t>(x);
      const Vector3f ray = rotation * camera::ray(static_cast<float>(x), static_cast<float>(y));
      const RayHit hit = scene.cast(origin, ray);
      Vector3f light = Vector3f(0.75f, 0.85f, 1.0f);  // the sky behind a window
      if (hit.hit) {
        const Vector3f point = origin + hit.t * ray;
        const Mesh& mesh = scene.mesh();
        const Vector3f colour =
            surface_colour(mesh.palette[mesh.materials[hit.triangle]], point, hit.normal, texture);
        const float shade = 0.45f + 0.3f * std::abs(hit.normal.dot(daylight)) +
                            0.2f * std::max(0.0f, hit.normal.z());
        light = shade * colour;
      }
      const std::uint64_t dice = mix64(noise ^ pixel);
      for (int c = 0; c < 3; ++c) {
        const float grain = 6.0f * (unit_float(dice >> (20 * c)) - 0.5f);
        image[3 * pixel + static_cast<std::size_t>(c)] = to_byte(light[c], grain);
      }
    }
  }
  return image;
}

std::vector<std::uint16_t> depth_image(const std::array<DepthQuarter, 4>& quarters) {
  std::vector<std::uint16_t> image(static_cast<std::size_t>(camera::kWidth) * camera::kHeight, 0);
  for (const DepthQuarter& quarter : quarters) {
    for (int row = 0; row < DepthQuarter::kHeight; ++row) {
      for (int column = 0; column < DepthQuarter::kWidth; ++column) {
        const float z = quarter.depth[static_cast<std::size_t>(row) * DepthQuarter::kWidth +
                                      static_cast<std::size_t>(column)];
        const std::size_t x = static_cast<std::size_t>(2 * column + quarter.phase_x),
                          y = static_cast<std::size_t>(2 * row + quarter.phase_y);
        image[y * camera::kWidth + x] =
            static_cast<std::uint16_t>(std::min(65535.0f, z * kDepthUnits + 0.5f));
      }
    }
  }
  return image;
}

void write_frame(const std::string& folder, int frame, const std::vector<std::uint8_t>& colour,
                 const std::vector<std::uint16_t>& depth) {
  std::vector<std::uint8_t> bytes(2 * depth.size());
  for (std::size_t i = 0; i < depth.size(); ++i) {
    bytes[2 * i] = static_cast<std::uint8_t>(depth[i] >> 8);
    bytes[2 * i + 1] = static_cast<std::uint8_t>(depth[i] & 0xFF);
  }
  const std::string name = timestamp(frame) + ".png";
  write_png(folder + "/depth/" + name, bytes, PNG_COLOR_TYPE_GRAY, 16);
  write_png(folder + "/rgb/" + name, colour, PNG_COLOR_TYPE_RGB, 8);
}

void write_sequence_lists(const std::string& folder,
                          const std::vector<Eigen::Isometry3d>& world_from_camera) {
  std::string rgb = "# color images\n# file: rgb.txt\n# timestamp filename\n";
  std::string depth = "# depth maps\n# file: depth.txt\n# timestamp filename\n";
  std::string associations,
      truth =
          "# ground truth trajectory\n# file: groundtruth.txt\n# timestamp tx ty tz qx qy qz qw\n";
  char line[192];
  for (std::size_t k = 0; k < world_from_camera.size(); ++k) {
    const std::string time = timestamp(static_cast<int>(k));
    rgb += time + " rgb/" + time + ".png\n";
    depth += time + " depth/" + time + ".png\n";
    associations += time + " rgb/" + time + ".png " + time + " depth/" + time + ".png\n";
    const Eigen::Vector3d t = world_from_camera[k].translation();
    const Eigen::Vector4d q = quaternion(world_from_camera[k]);
    std::snprintf(line, sizeof(line), " %.6f %.6f %.6f %.7f %.7f %.7f %.7f\n", t.x(), t.y(), t.z(),
                  q.x(), q.y(), q.z(), q.w());
    truth += time + line;
  }
  files::write_atomically(folder + "/rgb.txt", rgb);
  files::write_atomically(folder + "/depth.txt", depth);
  files::write_atomically(folder + "/groundtruth.txt", truth);
  files::write_atomically(folder + "/associations.txt", associations);
  // The format of OpenCV's FileStorage.
  std::snprintf(line, sizeof(line), "data: [ %.1f, 0., %.1f, 0., %.1f, %.1f, 0., 0., 1. ]\n",
                static_cast<double>(camera::kFocal), static_cast<double>(camera::kCentreX),
                static_cast<double>(camera::kFocal), static_cast<double>(camera::kCentreY));
  files::write_atomically(folder + "/camera.yaml",
                          "%YAML:1.0\n---\nimage_width: " + std::to_string(camera::kWidth) +
                              "\nimage_height: " + std::to_string(camera::kHeight) +
                              "\ncamera_matrix: !!opencv-matrix\n   rows: 3\n   cols: 3\n   dt: d\n"
                              "   " +
                              line);
}

void write_depth_calibration(const std::string& folder, const DepthSensor& sensor) {
  constexpr int kColumns = 9, kRows = 7;
  constexpr float kDepth = 2;  // metres: the offsets hardly depend on it
  std::string offsets;
  for (int row = 0; row < kRows; ++row) {
    for (int column = 0; column < kColumns; ++column) {
      const float x = static_cast<float>(column * (camera::kWidth - 1)) / (kColumns - 1),
                  y = static_cast<float>(row * (camera::kHeight - 1)) / (kRows - 1),
                  error = sensor.distortion(x, y, kDepth);
      char text[32];
      std::snprintf(text, sizeof(text), "%s%.7f", offsets.empty() ? "" : ", ",
                    static_cast<double>(-error / (kDepth * (1 + error))));
      offsets += text;
    }
  }
  files::write_atomically(
      folder + "/true_depth_calibration.json",
      "{\"columns\": 9, \"rows\": 7, \"width\": " + std::to_string(camera::kWidth) +
          ", \"height\": " + std::to_string(camera::kHeight) + ", \"inverse_depth_offsets\": [" +
          offsets + "]}\n");
}

}  // namespace gpureg::synthetic
