// SPDX-License-Identifier: BSD-3-Clause
#include "cli/scene.hpp"

#include "gpureg/io.hpp"
#include "support/scan.hpp"

namespace gpureg::test {

std::vector<std::string> joined(std::vector<std::string> a, const std::vector<std::string>& b) {
  a.insert(a.end(), b.begin(), b.end());
  return a;
}

Eigen::Isometry3d scan_from_room(int number, const Eigen::Vector3f& size) {
  std::mt19937 random(static_cast<unsigned>(7 + number));
  Eigen::Isometry3d pose = random_pose(random, 0);  // the sensor is where it stands: at the origin
  pose.translation() = -(pose.linear() * kRoomSensor.cwiseProduct(size).cast<double>());
  return pose;
}

PointCloud room_scan(int number, const Eigen::Vector3f& size) {
  std::mt19937 random(static_cast<unsigned>(100 + number));
  const std::vector<Eigen::Vector3f> room = scan_room(random);
  const float missing = 0.4f * static_cast<float>(number % 7);
  PointCloud cloud;
  for (std::size_t k = 0; k < room.size(); k += 6)
    if (room[k].x() < missing || room[k].x() > missing + 0.3f)
      cloud.points.push_back(room[k].cwiseProduct(size));
  cloud.points = moved(scan_from_room(number, size), std::move(cloud.points));
  return cloud;
}

PointCloud sticks() {
  std::mt19937 random(5);
  std::uniform_real_distribution<float> place(-3, 3), along(-3, 3), turn(0, 6.2831853f);
  std::normal_distribution<float> normal;
  PointCloud cloud;
  for (int stick = 0; stick < 24; ++stick) {
    const Eigen::Vector3f middle(place(random), place(random), place(random));
    const Eigen::Quaternionf pose =
        Eigen::Quaternionf(normal(random), normal(random), normal(random), normal(random))
            .normalized();
    for (int k = 0; k < 800; ++k) {
      const float angle = turn(random);
      cloud.points.push_back(middle + pose * Eigen::Vector3f(0.04f * std::cos(angle),
                                                             0.04f * std::sin(angle),
                                                             along(random)));
    }
  }
  return cloud;
}

void write_scans(const TemporaryFolder& folder, int scans, bool with_hopeless_ones) {
  int number = 0;
  const auto write = [&](const PointCloud& cloud) {
    write_cloud(folder, "cloud_bin_" + std::to_string(number++) + ".ply", cloud);
  };
  for (int k = 0; k < scans; ++k) write(room_scan(k));
  if (!with_hopeless_ones) return;
  write(sticks());
  PointCloud two;
  two.points = {{0, 0, 1}, {0.5f, 0, 1}};
  write(two);
}

void write_scans_of_another_room(const TemporaryFolder& folder, int first, int count) {
  for (int k = first; k < first + count; ++k)
    write_cloud(folder, "cloud_bin_" + std::to_string(k) + ".ply",
                room_scan(k, Eigen::Vector3f(1.6f, 0.7f, 1.3f)));
}

std::string write_cloud(const TemporaryFolder& folder, const std::string& name,
                        const PointCloud& cloud) {
  const std::string path = folder / name;
  io::write_point_cloud(path, cloud);
  return path;
}

nlohmann::json data_of(const std::string& page) {
  const std::size_t begin = page.find(R"(id="data">)") + 10;
  return nlohmann::json::parse(page.substr(begin, page.find("</script>", begin) - begin));
}

void expect_self_contained(const std::string& page) {
  for (const char* link :
       {"http://", "https://", " src=", "<link", "@import", "url(", "fetch(", "{{"})
    EXPECT_EQ(page.find(link), std::string::npos) << link;
  EXPECT_EQ(page.substr(page.size() - 24), "</script></body></html>\n");
}

nlohmann::json json_of(const std::string& path) { return nlohmann::json::parse(content_of(path)); }

nlohmann::json without_times(nlohmann::json document) {
  for (const char* name : {"seconds", "peak_memory_mib", "environment"}) document.erase(name);
  for (const char* list : {"fragments", "pairs"})
    for (nlohmann::json& record : document.at(list)) record.erase("ms");
  return document;
}

}  // namespace gpureg::test
