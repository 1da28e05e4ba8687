// SPDX-License-Identifier: BSD-3-Clause
#include "sequence.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <gpureg/error.hpp>
#include <gpureg/evaluation.hpp>
#include <iterator>
#include <locale>
#include <map>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>
#include <sstream>

#include "camera_file.hpp"

namespace slam_demo {
namespace {

namespace fs = std::filesystem;
using gpureg::IoError;

constexpr double kFrameRate = 30;            // of layouts without times
constexpr double kMaxTimeDifference = 0.02;  // seconds between colour and depth of one frame

struct Listed {
  double time;
  std::string path;
};

/// Lines of words; '#' starts a comment.
std::vector<std::vector<std::string>> read_lines(const fs::path& path, std::size_t least) {
  std::ifstream file(path);
  if (!file) throw IoError(path.string() + ": cannot be read");
  std::vector<std::vector<std::string>> lines;
  std::string line;
  for (int number = 1; std::getline(file, line); ++number) {
    std::istringstream in(line.substr(0, line.find('#')));
    std::vector<std::string> words;
    for (std::string word; in >> word;) words.push_back(word);
    if (words.empty()) continue;
    if (words.size() < least)
      throw IoError(path.string() + ":" + std::to_string(number) + ": needs " +
                    std::to_string(least) + " words, has " + std::to_string(words.size()));
    lines.push_back(words);
  }
  return lines;
}

/// Reads a word as a number, whatever the locale of the program.
bool parse(const std::string& word, double& value) {
  std::istringstream in(word);
  in.imbue(std::locale::classic());
  return in >> value && in.peek() == std::istringstream::traits_type::eof() && std::isfinite(value);
}

double number(const std::string& word, const fs::path& path) {
  double value = 0;
  if (!parse(word, value)) throw IoError(path.string() + ": '" + word + "' is no number");
  return value;
}

/// The file `preferred` of a folder, else the only one whose name ends so; empty where none does.
fs::path only_file(const fs::path& folder, const std::string& ending, const char* preferred) {
  if (fs::exists(folder / preferred)) return folder / preferred;
  std::vector<fs::path> found;
  for (const auto& entry : fs::directory_iterator(folder)) {
    const std::string name = entry.path().filename().string();
    if (name.size() > ending.size() &&
        name.compare(name.size() - ending.size(), ending.size(), ending) == 0)
      found.push_back(entry.path());
  }
  std::sort(found.begin(), found.end());
  if (found.size() > 1)
    throw IoError(found[0].string() + " and " + found[1].string() +
                  ": only one can be the true trajectory; call it " + preferred +
                  ", or name it by --groundtruth");
  return found.empty() ? fs::path() : found[0];
}

/// The digits at the end of a name without its extensions; -1 without.
long index_of(const fs::path& path) {
  std::string name = path.filename().string();
  name = name.substr(0, name.find('.'));
  const std::size_t start = name.find_last_not_of("0123456789") + 1;
  return start < name.size() && name.size() - start < 10 ? std::stol(name.substr(start)) : -1;
}

std::vector<Listed> read_list(const fs::path& folder, const char* name) {
  std::vector<Listed> result;
  for (const auto& words : read_lines(folder / name, 2))
    result.push_back({number(words[0], folder / name), (folder / words[1]).string()});
  return result;
}

/// Of entries by ascending time; of two at the same distance the earlier one.
std::vector<Listed>::const_iterator nearest_to(double time, const std::vector<Listed>& entries) {
  const auto from = [&](double t) {
    return std::lower_bound(entries.begin(), entries.end(), t,
                            [](const Listed& entry, double value) { return entry.time < value; });
  };
  const auto after = from(time);
  if (after == entries.begin()) return after;
  const double before = std::prev(after)->time;
  return after != entries.end() && after->time - time < time - before ? after : from(before);
}

/// The published cameras of the two benchmarks. Names say which one it is: of the folder, of the
/// bag in rgb.txt, of the true trajectory.
void set_published_camera(const fs::path& folder, const fs::path& truth, Rig& rig) {
  struct Published {
    const char* name;
    Pinhole camera;
    std::array<double, 5> distortion;
  };
  static const Published kPublished[] = {
      {"freiburg1", {517.3, 516.5, 318.6, 255.3}, {0.2624, -0.9531, -0.0054, 0.0026, 1.1633}},
      {"freiburg2", {520.9, 521.0, 325.1, 249.7}, {0.2312, -0.7849, -0.0033, -0.0001, 0.9172}},
      {"freiburg3", {535.4, 539.2, 320.1, 247.6}, {}},
      {".gt.freiburg", {481.2, -480.0, 319.5, 239.5}, {}},  // ICL-NUIM, whose y points up
      {"_frei_png", {481.2, -480.0, 319.5, 239.5}, {}}};
  std::string names = fs::absolute(folder).lexically_normal().string() + "\n" +
                      truth.filename().string() + "\n",
              line;
  std::ifstream list(folder / "rgb.txt");
  while (std::getline(list, line) && !line.empty() && line[0] == '#') names += line;
  for (const Published& p : kPublished) {
    if (names.find(p.name) == std::string::npos) continue;
    const cv::Mat1d distortion(1, 5, const_cast<double*>(p.distortion.data()));
    set_camera(p.camera, distortion, {640, 480}, rig);
    return;
  }
}

Sequence open_tum(const fs::path& folder) {
  Sequence result;
  result.layout = "TUM";
  std::vector<FrameFiles>& frames = result.frames;
  if (fs::exists(folder / "associations.txt")) {
    for (auto words : read_lines(folder / "associations.txt", 4)) {
      // ICL-NUIM names the depth image first.
      if (words[1].find("depth") != std::string::npos) {
        std::swap(words[0], words[2]);
        std::swap(words[1], words[3]);
      }
      const double time = number(words[0], folder / "associations.txt");
      frames.push_back({time, (folder / words[1]).string(), (folder / words[3]).string(),
                        number(words[2], folder / "associations.txt") - time});
    }
  } else {
    std::vector<Listed> depth = read_list(folder, "depth.txt");
    std::stable_sort(depth.begin(), depth.end(),
                     [](const Listed& a, const Listed& b) { return a.time < b.time; });
    for (const Listed& colour : read_list(folder, "rgb.txt")) {
      const auto nearest = nearest_to(colour.time, depth);
      if (nearest == depth.end() || std::abs(nearest->time - colour.time) > kMaxTimeDifference)
        continue;
      frames.push_back({colour.time, colour.path, nearest->path, nearest->time - colour.time});
    }
  }
  const fs::path truth = only_file(folder, ".gt.freiburg", "groundtruth.txt");
  if (!truth.empty()) result.truth = gpureg::evaluation::read_trajectory(truth.string());
  set_published_camera(folder, truth, result.rig);
  return result;
}

/// Of two files with the same number the one whose name comes first.
void keep_first(std::string& kept, const std::string& path) {
  if (kept.empty() || path < kept) kept = path;
}

std::map<long, std::string> numbered(const fs::path& folder) {
  std::map<long, std::string> result;
  for (const auto& entry : fs::directory_iterator(folder)) {
    const long index = index_of(entry.path());
    if (index >= 0) keep_first(result[index], entry.path().string());
  }
  return result;
}

/// `count` numbers, row by row.
std::vector<double> read_numbers(const fs::path& path, std::size_t count) {
  std::ifstream file(path);
  std::vector<double> numbers(count);
  std::string word;
  for (double& value : numbers) {
    if (!(file >> word) || !parse(word, value))
      throw IoError(path.string() + ": needs " + std::to_string(count) + " numbers");
  }
  return numbers;
}

Eigen::Matrix4d read_pose(const fs::path& path) {
  const std::vector<double> numbers = read_numbers(path, 16);
  Eigen::Matrix4d pose = Eigen::Matrix<double, 4, 4, Eigen::RowMajor>(numbers.data());
  const Eigen::Quaterniond turn(Eigen::Matrix3d(pose.topLeftCorner<3, 3>()));
  pose.topLeftCorner<3, 3>() = turn.normalized().toRotationMatrix();  // files have few digits
  return pose;
}

Sequence open_redwood(const fs::path& folder, const fs::path& colour) {
  Sequence result;
  result.layout = "Redwood";
  result.rig.known = true;  // 525 pixels, of the data set
  result.rig.depth_units = 1000;
  const std::map<long, std::string> images = numbered(colour);
  for (const auto& [index, path] : numbered(folder / "depth")) {
    const auto image = images.find(index);
    if (image != images.end())
      result.frames.push_back({static_cast<double>(index) / kFrameRate, image->second, path});
  }
  const fs::path truth = only_file(folder, ".log", "trajectory.log");
  if (truth.empty()) return result;
  for (const auto& pose : gpureg::evaluation::read_log(truth.string()))
    result.truth.push_back({pose.i / kFrameRate, pose.transform});
  return result;
}

Sequence open_seven_scenes(const fs::path& folder) {
  Sequence result;
  result.layout = "7-Scenes";
  Rig& rig = result.rig;
  rig.depth_units = 1000;
  rig.registered = false;
  rig.known = true;
  rig.truth_of_depth = true;
  rig.depth = {585, 585, 320, 240};
  // Measured on depth and colour edges of the red kitchen; the data set publishes neither.
  rig.colour = {525.5, 525.5, 322.2, 235.8};
  rig.colour_from_depth.translation() = Eigen::Vector3d(-0.031, 0.007, 0);
  if (fs::exists(folder / "camera-intrinsics.txt")) {
    const std::vector<double> k = read_numbers(folder / "camera-intrinsics.txt", 9);
    rig.depth = {k[0], k[4], k[2], k[5]};
  }
  std::map<long, FrameFiles> frames;
  for (const auto& entry : fs::directory_iterator(folder)) {
    const std::string name = entry.path().filename().string();
    const long index = index_of(entry.path());
    if (index < 0 || name.rfind("frame-", 0) != 0) continue;
    if (name.find(".color.") != std::string::npos)
      keep_first(frames[index].colour, entry.path().string());
    if (name.find(".depth.") != std::string::npos)
      keep_first(frames[index].depth, entry.path().string());
  }
  for (auto& [index, frame] : frames) {
    frame.time = static_cast<double>(index) / kFrameRate;
    result.frames.push_back(frame);
    char name[32];
    std::snprintf(name, sizeof(name), "frame-%06ld.pose.txt", index);
    if (fs::exists(folder / name)) result.truth.push_back({frame.time, read_pose(folder / name)});
  }
  return result;
}

}  // namespace

Sequence open_sequence(const std::string& name) {
  const fs::path folder = name;
  std::error_code error;
  if (!fs::is_directory(folder, error)) throw IoError(name + ": no such folder");
  Sequence result;
  fs::path colour;
  for (const char* candidate : {"color", "image", "rgb"}) {
    if (colour.empty() && fs::is_directory(folder / candidate, error)) colour = folder / candidate;
  }
  if (fs::exists(folder / "associations.txt") ||
      (fs::exists(folder / "rgb.txt") && fs::exists(folder / "depth.txt"))) {
    result = open_tum(folder);
  } else if (fs::is_directory(folder / "depth", error) && !colour.empty()) {
    result = open_redwood(folder, colour);
  } else {
    result = open_seven_scenes(folder);
  }
  if (fs::exists(folder / "camera.yaml"))
    read_camera((folder / "camera.yaml").string(), result.rig);
  std::vector<FrameFiles> ordered;
  for (const FrameFiles& frame : result.frames) {
    if (!ordered.empty() && frame.time <= ordered.back().time)
      ++result.out_of_order;
    else
      ordered.push_back(frame);
  }
  result.frames = ordered;
  if (result.frames.empty())
    throw IoError(name +
                  ": no frames; known are TUM and ICL-NUIM (associations.txt, or rgb.txt and "
                  "depth.txt), Redwood (depth/ and color/) and 7-Scenes (frame-NNNNNN.color.png)");
  return result;
}

Images load(const FrameFiles& files, const Rig& rig) {
  Images result;
  // The other image still helps to find the frame's place among the others in time.
  cv::Mat colour = files.colour.empty() ? cv::Mat() : cv::imread(files.colour, cv::IMREAD_COLOR);
  cv::Mat depth = files.depth.empty() ? cv::Mat() : cv::imread(files.depth, cv::IMREAD_UNCHANGED);
  if (colour.empty()) {
    result.problem = files.colour + ": missing or damaged";
  } else if (depth.empty() || depth.type() != CV_16UC1) {
    result.problem = files.depth + ": missing, damaged, or not 16 bit";
  } else if (depth.size() != colour.size()) {
    result.problem = files.depth + ": not of the size of " + files.colour;
  }
  const bool distorted = !rig.undistort_x.empty();
  if (result.problem.empty() && distorted && colour.size() != rig.undistort_x.size())
    result.problem = files.colour + ": not of the size of the camera";
  if (!result.problem.empty()) return result;
  if (rig.flipped) {
    cv::flip(colour, colour, 0);
    cv::flip(depth, depth, 0);
  }
  if (distorted) {
    cv::remap(colour.clone(), colour, rig.undistort_x, rig.undistort_y, cv::INTER_LINEAR);
    // A registered depth image has the pixels of the colour image.
    if (rig.registered)
      cv::remap(depth.clone(), depth, rig.undistort_x, rig.undistort_y, cv::INTER_NEAREST);
  }
  result.colour = colour;
  cv::cvtColor(colour, result.grey, cv::COLOR_BGR2GRAY);
  result.depth = depth_in_colour(depth, rig);
  result.depth_delay = files.depth_delay;
  return result;
}

}  // namespace slam_demo
