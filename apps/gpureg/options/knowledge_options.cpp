// SPDX-License-Identifier: BSD-3-Clause
#include "options/knowledge_options.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <iostream>
#include <sstream>

#include "command_line.hpp"
#include "gpureg/error.hpp"
#include "text.hpp"

namespace gpureg::cli {
namespace {

/// Numbers between commas; empty where one of them is none.
std::vector<double> numbers_of(const std::string& text) {
  std::vector<double> out;
  std::istringstream fields(text + ",");
  for (std::string field; std::getline(fields, field, ',');) {
    double number = 0;
    if (!read_number(field, number)) return {};
    out.push_back(number);
  }
  return out;
}

Eigen::Vector3d direction(const std::vector<double>& numbers) {
  return {numbers[0], numbers[1], numbers[2]};
}

}  // namespace

bool ViewpointChoice::is_word() const {
  return text == "auto" || text == "none" || text == "model";
}

void ViewpointChoice::check(const char* option) const {
  if (is_word()) return;
  const std::vector<double> numbers = numbers_of(text);
  if (numbers.size() != 3 || !direction(numbers).allFinite())
    throw InvalidArgument(std::string(option) + " is " + text +
                          ", expected x,y,z (finite), model, none or auto");
}

void ViewpointChoice::apply(PointCloud& cloud) const {
  if (text == "auto") return;
  cloud.viewpoints.clear();
  if (!is_word()) cloud.set_viewpoints({direction(numbers_of(text))});
}

void ViewpointChoice::check_cloud(const char* option, const PointCloud& cloud,
                                  const std::string& file) const {
  if (text == "model" && cloud.normals.empty() && !cloud.points.empty())
    throw InvalidArgument(std::string(option) + " model needs normals that point outwards, and " +
                          file + " has none: give a mesh, or write normals into the file");
}

void ViewpointChoice::note_place(const char* option, const PreparedCloud& cloud,
                                 const std::string& file) const {
  if (is_word()) return;
  const Eigen::Vector3f place = (direction(numbers_of(text)) - cloud.origin()).cast<float>();
  // One point within a voxel may be a return of the sensor itself, a surface has about three.
  constexpr std::ptrdiff_t kSurface = 2;
  const float voxel = cloud.voxel_size();
  const std::vector<Eigen::Vector3f> points = cloud.points();
  const std::ptrdiff_t near =
      std::count_if(points.begin(), points.end(),
                    [&](const Eigen::Vector3f& p) { return (p - place).norm() <= voxel; });
  if (near < kSurface) return;
  std::cerr << "gpureg: note: " << option << " " << text << " lies on a surface of " << file << ", "
            << near << " prepared points are within a voxel of it: is it in the frame of the cloud?"
            << std::endl;
}

PointCloudView ViewpointChoice::view(const PointCloud& cloud) const {
  PointCloudView view = cloud.view();
  view.infer_viewpoint = text != "none";
  if (text == "none") view.model = false;
  if (text == "model") view.model = true;
  return view;
}

namespace {

/// Direction of an option, and max_angle where the text has a fourth number.
Eigen::Vector3d up_of(const std::string& option, const std::string& text, double* max_angle) {
  const std::vector<double> numbers = numbers_of(text);
  const auto refuse = [&](const char* expected) {
    throw InvalidArgument(option + " is " + text + ", expected " + expected);
  };
  const bool angle = max_angle != nullptr && numbers.size() == 4;
  if (numbers.size() != 3 && !angle)
    refuse(max_angle != nullptr ? "x,y,z or x,y,z,degrees" : "x,y,z");
  const Eigen::Vector3d up = direction(numbers);
  if (!up.allFinite() || !(up.norm() > 1e-9)) refuse("a direction x,y,z, finite and not 0");
  if (angle) *max_angle = numbers[3];
  if (angle && !(*max_angle > 0 && *max_angle <= 180)) refuse("degrees in (0, 180]");
  return up;
}

}  // namespace

std::optional<GravityPrior> up_prior(const std::string& text) {
  return UpChoice{text, "", ""}.prior();
}

void UpChoice::add_to(Verb& verb, const std::string& clouds, const std::string& source,
                      const std::string& target) {
  verb.option("--up", up,
              "Vertical direction x,y,z in " + clouds +
                  ", and perhaps how many degrees it may be off (without: 10): 0,0,1,5");
  verb.option("--source-up", source_up,
              "The same of " + source + " alone, x,y,z, where its frame differs");
  verb.option("--target-up", target_up, "The same of " + target + " alone");
}

std::optional<GravityPrior> UpChoice::prior() const {
  if (up.empty() && source_up.empty() && target_up.empty()) return std::nullopt;
  GravityPrior prior;
  if (!up.empty()) prior.source_up = prior.target_up = up_of("--up", up, &prior.max_angle);
  if (!source_up.empty()) prior.source_up = up_of("--source-up", source_up, nullptr);
  if (!target_up.empty()) prior.target_up = up_of("--target-up", target_up, nullptr);
  if (up.empty() && (source_up.empty() || target_up.empty()))
    throw InvalidArgument(source_up.empty() ? "--target-up needs --up or --source-up"
                                            : "--source-up needs --up or --target-up");
  return prior;
}

}  // namespace gpureg::cli
