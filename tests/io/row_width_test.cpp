// SPDX-License-Identifier: BSD-3-Clause
// Scans without a header: what the numbers tell of the width of their rows. A false width is worse
// than none.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <functional>
#include <map>
#include <random>

#include "gpureg/error.hpp"
#include "gpureg/io.hpp"
#include "support/data_folder.hpp"
#include "support/expect_error.hpp"
#include "support/temporary_folder.hpp"

namespace gpureg::io {
namespace {

using test::TemporaryFolder;
using Column = std::vector<float>;
using Columns = std::vector<Column>;

enum class Order { by_beam, by_firing, shuffled };
constexpr Order kOrders[] = {Order::by_beam, Order::by_firing, Order::shuffled};

/// Points that a rotating scanner sees, and what it knows of each of them.
struct Sweep {
  Columns xyz = Columns(3);
  Column beam, time;
};

/// Distance to the inside of a box around the sensor.
float range_in(const Eigen::Vector3f& low, const Eigen::Vector3f& high,
               const Eigen::Vector3f& ray) {
  float range = 1e9f;
  for (int k = 0; k < 3; ++k) range = std::min(range, (ray[k] > 0 ? high[k] : low[k]) / ray[k]);
  return range;
}

/// A room, or a street with walls on both sides; 2,000 points or more.
Sweep sweep_of(bool street, int beams, Order order) {
  const Eigen::Vector3f low = street ? Eigen::Vector3f(-900, -9, -1.8f)
                                     : Eigen::Vector3f(-3, -2, -1.2f),
                        high =
                            street ? Eigen::Vector3f(900, 13, 90) : Eigen::Vector3f(2, 2.4f, 1.3f);
  std::mt19937 random(static_cast<unsigned>(beams));
  std::normal_distribution<float> noise(0, 0.02f);
  const int turns = 6000 / beams;
  std::vector<std::pair<int, int>> rays;
  for (int beam = 0; beam < beams; ++beam)
    for (int turn = 0; turn < turns; ++turn) rays.emplace_back(beam, turn);
  if (order == Order::by_firing)
    std::stable_sort(rays.begin(), rays.end(),
                     [](const auto& a, const auto& b) { return a.second < b.second; });
  if (order == Order::shuffled) std::shuffle(rays.begin(), rays.end(), random);
  Sweep sweep;
  for (const auto& [beam, turn] : rays) {
    const float up = (-25.f + 35.f * static_cast<float>(beam) / static_cast<float>(beams)) *
                     0.01745f,
                around = 6.2832f * (static_cast<float>(turn) + 0.3f) / static_cast<float>(turns);
    const Eigen::Vector3f ray(std::cos(up) * std::cos(around), std::cos(up) * std::sin(around),
                              std::sin(up));
    const float range = range_in(low, high, ray) + noise(random);
    if (range > 70) continue;
    for (int k = 0; k < 3; ++k) sweep.xyz[static_cast<std::size_t>(k)].push_back(range * ray[k]);
    sweep.beam.push_back(static_cast<float>(beam));
    sweep.time.push_back(0.1f * around / 6.2832f);
  }
  // Of a size that every width divides: the size alone tells nothing.
  const std::size_t size = sweep.time.size() / 840 * 840;
  for (Column* column : {&sweep.xyz[0], &sweep.xyz[1], &sweep.xyz[2], &sweep.beam, &sweep.time})
    column->resize(size);
  return sweep;
}

Column filled(std::size_t size, const std::function<float()>& next) {
  Column column(size);
  for (float& value : column) value = next();
  return column;
}

/// What sensors write for the strength of a return.
std::vector<Column> intensities(std::size_t size) {
  std::mt19937 random(3);
  std::uniform_int_distribution<int> byte(0, 255), word(0, 65535), percent(0, 100);
  return {Column(size, 0.f),
          filled(size, [&] { return 0.01f * static_cast<float>(percent(random)); }),
          filled(size, [&] { return static_cast<float>(byte(random)); }),
          filled(size, [&] { return static_cast<float>(word(random)); })};
}

std::string bytes_of(const Columns& columns) {
  std::string bytes;
  for (std::size_t row = 0; row < columns[0].size(); ++row)
    for (const Column& column : columns) {
      char raw[sizeof(float)];
      std::memcpy(raw, &column[row], sizeof raw);
      bytes.append(raw, sizeof raw);
    }
  return bytes;
}

/// Columns as a file; reads it back.
class RowWidth : public testing::Test {
 protected:
  PointCloud read(const Columns& columns) const {
    return read_point_cloud(folder.write("scan.bin", bytes_of(columns)));
  }
  static bool are_points_of(const PointCloud& cloud, const Columns& xyz) {
    if (cloud.points.size() != xyz[0].size()) return false;
    for (std::size_t k = 0; k < cloud.points.size(); ++k)
      if (cloud.points[k] != Eigen::Vector3f(xyz[0][k], xyz[1][k], xyz[2][k])) return false;
    return true;
  }
  /// Whether the right points are read. Others must not be.
  bool reads(const Columns& columns) const {
    try {
      const bool right = are_points_of(read(columns), columns);
      EXPECT_TRUE(right) << "misread";
      return right;
    } catch (const IoError&) {
      return false;
    }
  }

  static Columns with(const Sweep& sweep, const Columns& more) {
    Columns columns = sweep.xyz;
    columns.insert(columns.end(), more.begin(), more.end());
    return columns;
  }
  /// For scanners of one beam and more, in every order.
  template <typename Check>
  static void each_sweep(const Check& check) {
    for (const bool street : {false, true})
      for (const int beams : {1, 2, 4, 16, 32, 64})
        for (const Order order : kOrders) {
          SCOPED_TRACE((street ? "street, " : "room, ") + std::to_string(beams) + " beams, order " +
                       std::to_string(static_cast<int>(order)));
          check(sweep_of(street, beams, order));
        }
  }

  const TemporaryFolder folder;
};

TEST_F(RowWidth, EveryScanOfKittiIsRead) {
  each_sweep([&](const Sweep& sweep) {
    Columns kinds = intensities(sweep.time.size());
    Column before = sweep.time;  // a time that counts back from the end of the sweep
    for (float& t : before) t -= 0.1f;
    for (const Column& other : {sweep.beam, sweep.time, before}) kinds.push_back(other);
    for (std::size_t k = 0; k < kinds.size(); ++k)
      EXPECT_TRUE(reads(with(sweep, {kinds[k]}))) << "kind " << k;
  });
}

TEST_F(RowWidth, EveryScanOfFiveNumbersIsRead) {
  each_sweep([&](const Sweep& sweep) {
    for (const Column& intensity : intensities(sweep.time.size()))
      for (const Column& last : {sweep.beam, sweep.time})
        EXPECT_TRUE(reads(with(sweep, {intensity, last})));
  });
}

TEST_F(RowWidth, RowsOfAnyOtherWidthAreReadRightOrRefused) {
  std::mt19937 random(5);
  std::normal_distribution<float> normal;
  std::map<std::size_t, int> right;
  each_sweep([&](const Sweep& sweep) {
    const std::size_t size = sweep.time.size();
    const Columns kinds = intensities(size);
    const Column &zero = kinds[0], &unit = kinds[1], &byte = kinds[2], &word = kinds[3];
    const Column ones(size, 1.f);
    Columns normals(3, Column(size));
    for (std::size_t k = 0; k < size; ++k) {
      Eigen::Vector3f n(normal(random), normal(random), normal(random));
      n = random() % 3 == 0 ? Eigen::Vector3f(0, 0, 1) : n.normalized().eval();
      for (std::size_t axis = 0; axis < 3; ++axis) normals[axis][k] = n[static_cast<int>(axis)];
    }
    Columns colours;
    for (int k = 0; k < 3; ++k)
      colours.push_back(filled(size, [&] { return static_cast<float>(random() % 256); }));
    for (const Columns& more :
         {Columns{}, normals, colours, Columns{unit, byte, sweep.time},
          Columns{colours[0], colours[1], colours[2], unit},
          Columns{normals[0], normals[1], normals[2], byte}, Columns{ones, byte, zero, zero, zero},
          Columns{byte, sweep.time, word, sweep.beam, word},
          Columns{byte, byte, sweep.beam, sweep.time, zero, zero},
          Columns{byte, word, zero, sweep.beam, byte, sweep.time, zero},
          Columns{ones, normals[0], normals[1], normals[2], zero, byte, zero, zero, zero}}) {
      SCOPED_TRACE(std::to_string(3 + more.size()) + " columns");
      right[3 + more.size()] += reads(with(sweep, more));
    }
  });
  EXPECT_GT(right[3], 24) << "of 36 scans of x y z";
  EXPECT_GE(right[6], 72) << "of 108 scans with normals, colours or times";
  for (const std::size_t width : {7u, 8u, 9u, 10u, 12u}) EXPECT_EQ(right[width], 0) << width;
}

TEST_F(RowWidth, RandomNumbersAreNoScan) {
  std::mt19937 random(7);
  std::normal_distribution<float> normal;
  std::uniform_real_distribution<float> unit(0, 1), metres(-50, 50);
  float walk = 0;
  for (const std::size_t rows : {64u, 100u, 1000u, 20000u})
    for (std::size_t width = 3; width <= 6; ++width)
      for (const std::function<float()>& next : std::vector<std::function<float()>>{
               [&] { return normal(random); }, [&] { return unit(random); },
               [&] { return metres(random); }, [&] { return walk += normal(random); },
               [&] { return std::floor(metres(random)); }}) {
        Columns columns;
        for (std::size_t k = 0; k < width; ++k) columns.emplace_back();
        for (std::size_t row = 0; row < rows; ++row)
          for (Column& column : columns) column.push_back(next());
        if (rows * width < 256) continue;
        EXPECT_THROW(read(columns), IoError) << rows << " rows of " << width;
      }
  // Bytes of any file, and numbers of another type.
  std::string bytes(80000, '\0');
  for (char& c : bytes) c = static_cast<char>(random());
  EXPECT_THROW(read_point_cloud(folder.write("bytes.bin", bytes)), IoError);
  std::string doubles;
  for (int k = 0; k < 12000; ++k) {
    const double value = static_cast<double>(metres(random));
    doubles.append(reinterpret_cast<const char*>(&value), sizeof value);
  }
  EXPECT_THROW(read_point_cloud(folder.write("doubles.bin", doubles)), IoError);
}

TEST_F(RowWidth, WhatIsRefusedIsNamed) {
  const Sweep sweep = sweep_of(true, 32, Order::by_firing);
  const std::vector<Column> kinds = intensities(sweep.time.size());
  const auto refused = [&](const std::string& bytes, std::initializer_list<std::string> fragments) {
    const std::string path = folder.write("scan.bin", bytes);
    test::expect_error<IoError>([&] { read_point_cloud(path); }, fragments);
  };
  const std::string five = bytes_of(with(sweep, {kinds[2], sweep.beam}));
  // Cut off in the middle of a row, at a size of KITTI.
  refused(five.substr(0, five.size() - 16), {"rows of 5", "as of nuScenes"});
  refused(bytes_of(with(sweep, {kinds[2], kinds[2], sweep.beam, sweep.time})), {"rows of 7"});
  Column negative = kinds[1];
  negative[5] = -1;
  refused(bytes_of(with(sweep, {negative, sweep.beam})), {"rows of five", "1 intensities"});
  std::mt19937 random(9);
  std::normal_distribution<float> normal;
  refused(bytes_of(Columns(4, filled(1000, [&] { return normal(random); }))),
          {"do not look like rows"});
}

TEST_F(RowWidth, RealScansWithAnyIntensityAreRead) {
  GPUREG_DATA_FOLDER_OR_SKIP(data, "kitti");
  GPUREG_DATA_FOLDER_OR_SKIP(lidar, "lidar");
  std::vector<std::string> files = {lidar + "/source.ply", lidar + "/target.ply"};
  for (const auto& entry : std::filesystem::directory_iterator(data))
    if (entry.path().extension() == ".ply") files.push_back(entry.path().string());
  EXPECT_GT(files.size(), 5u);
  for (const std::string& file : files) {
    SCOPED_TRACE(file);
    const PointCloud cloud = read_point_cloud(file);
    Columns xyz(3);
    for (const Eigen::Vector3f& p : cloud.points)
      for (int k = 0; k < 3; ++k) xyz[static_cast<std::size_t>(k)].push_back(p[k]);
    for (Column& column : xyz) column.resize(column.size() / 20 * 20);
    const std::vector<Column> kinds = intensities(xyz[0].size());
    for (std::size_t k = 0; k < kinds.size(); ++k) {
      EXPECT_TRUE(reads({xyz[0], xyz[1], xyz[2], kinds[k]})) << "four numbers, kind " << k;
      EXPECT_TRUE(reads({xyz[0], xyz[1], xyz[2], kinds[k], kinds[2]})) << "five, kind " << k;
    }
  }
}

}  // namespace
}  // namespace gpureg::io
