// SPDX-License-Identifier: BSD-3-Clause
#include "inputs/scene.hpp"

#include <algorithm>
#include <cstring>
#include <filesystem>
#include <iostream>
#include <map>
#include <optional>
#include <set>

#include "gpureg/error.hpp"
#include "gpureg/io.hpp"
#include "inputs/cloud_file.hpp"
#include "run/interrupt.hpp"
#include "run/progress.hpp"
#include "run/sensor_fixed_note.hpp"
#include "run/spacing.hpp"
#include "run/viewpoint_note.hpp"

namespace gpureg::cli {
namespace {

// One batch for prepare(): enough to fill a device, little beside the 1 GiB that a long run may
// take.
constexpr std::size_t kChunkClouds = 32, kChunkPoints = 4'000'000;

void mix(std::uint64_t& hash, const std::vector<Eigen::Vector3f>& rows) {
  const auto add = [&](std::uint64_t word) {
    hash = (hash ^ word) * 0x9E3779B97F4A7C15ull;
    hash ^= hash >> 32;
  };
  add(rows.size());
  for (const Eigen::Vector3f& row : rows) {
    std::uint32_t bits[3];
    std::memcpy(bits, row.data(), sizeof(bits));
    add(bits[0] | static_cast<std::uint64_t>(bits[1]) << 32);
    add(bits[2]);
  }
}

using Fragments = std::vector<io::ScanFile>;
using Cameras = std::map<int, std::vector<Eigen::Vector3d>>;

// A file that covers half of the scene works, but hardly as meant.
void note_gaps(const Fragments& fragments, const Cameras& cameras, const std::string& file) {
  std::size_t covered = 0;
  for (const io::ScanFile& scan : fragments) covered += cameras.count(scan.number);
  const std::size_t lacking = fragments.size() - covered, strangers = cameras.size() - covered;
  if (lacking > 0)
    std::cerr << "gpureg: note: " << lacking << " of " << fragments.size()
              << " fragments have no camera in " << file << std::endl;
  for (auto at = cameras.begin(); strangers > 0 && at != cameras.end(); ++at)
    if (std::none_of(fragments.begin(), fragments.end(),
                     [&](const io::ScanFile& scan) { return scan.number == at->first; })) {
      std::cerr << "gpureg: note: " << file << " has cameras of fragment " << at->first
                << (strangers > 1 ? " and " + std::to_string(strangers - 1) + " more" : "")
                << ", which the folder lacks" << std::endl;
      return;
    }
}

std::uint64_t hash_of(const PointCloud& cloud) {
  std::uint64_t hash = 0x67707572ull;
  mix(hash, cloud.points);
  mix(hash, cloud.normals);
  mix(hash, cloud.viewpoints);
  if (!cloud.origin.isZero(0)) {
    const Eigen::Vector3f coarse = cloud.origin.cast<float>();
    mix(hash, {coarse, (cloud.origin - coarse.cast<double>()).cast<float>()});
  }
  return hash;
}

struct Prepared {
  std::optional<PreparedCloud> cloud;
  std::string reason;  // why there is none
};

// Of clouds that are read, those that can be prepared: together, and one by one where one cannot.
std::vector<Prepared> prepare_usable(const Context& context, const std::vector<std::string>& names,
                                     const std::vector<PointCloud>& clouds,
                                     const PrepareOptions& options, bool infer_viewpoint) {
  std::vector<PointCloudView> views;
  for (std::size_t k = 0; k < clouds.size(); ++k) {
    views.push_back(clouds[k].view());
    views.back().infer_viewpoint = infer_viewpoint || !clouds[k].viewpoints.empty();
  }
  std::vector<Prepared> out;
  try {
    for (PreparedCloud& cloud : prepare_batch(context, views, options, names))
      out.push_back({std::move(cloud), ""});
    return out;
  } catch (const InvalidArgument&) {
  }
  for (std::size_t k = 0; k < views.size(); ++k) try {
      out.push_back({prepare_batch(context, {views[k]}, options, {names[k]}).front(), ""});
    } catch (const InvalidArgument& error) {
      out.push_back({std::nullopt, error.what()});
    }
  return out;
}

}  // namespace

FragmentFolder::FragmentFolder(const ScanInput& input, bool quiet) : scans(input.list(quiet)) {
  for (const io::ScanFile& scan : scans) numbers.push_back(scan.number);
  count_ = numbers.back() + 1;
  const std::string cameras_file = (std::filesystem::path(input.folder()) / "cameras.txt").string();
  if (!std::filesystem::exists(cameras_file)) return;
  cameras_ = io::read_cameras(cameras_file, scans);
  if (!quiet) note_gaps(scans, cameras_, cameras_file);
}

std::vector<io::ScanFile> FragmentFolder::all() const {
  std::vector<io::ScanFile> out = scans;
  for (const UnusableFragment& fragment : unusable) out.push_back(fragment.scan);
  std::sort(out.begin(), out.end(),
            [](const io::ScanFile& a, const io::ScanFile& b) { return a.number < b.number; });
  return out;
}

bool FragmentFolder::has(int number) const {
  return std::binary_search(numbers.begin(), numbers.end(), number);
}

std::uint32_t FragmentFolder::index_of(int number) const {
  const auto at = std::lower_bound(numbers.begin(), numbers.end(), number);
  return static_cast<std::uint32_t>(at - numbers.begin());
}

PointCloud FragmentFolder::read(std::size_t k, double spacing, MeshNote note) const {
  PointCloud cloud = read_cloud(scans[k].path, spacing, note);
  if (const auto found = cameras_.find(numbers[k]); found != cameras_.end())
    cloud.set_viewpoints(found->second);
  return cloud;
}

bool FragmentFolder::is_unusable(int number) const {
  return std::any_of(unusable.begin(), unusable.end(), [&](const UnusableFragment& fragment) {
    return fragment.scan.number == number;
  });
}

void FragmentFolder::leave_out(const std::map<std::size_t, std::string>& reasons) {
  if (reasons.empty()) return;
  if (numbers.size() - reasons.size() < 2) throw IoError(reasons.begin()->second);
  std::vector<int> kept_numbers;
  std::vector<io::ScanFile> kept_scans;
  for (std::size_t k = 0; k < numbers.size(); ++k)
    if (const auto found = reasons.find(k); found != reasons.end()) {
      std::cerr << "gpureg: " << titled(scans[k]) << " is left out: " << found->second << std::endl;
      unusable.push_back({std::move(scans[k]), found->second});
    } else {
      kept_numbers.push_back(numbers[k]);
      kept_scans.push_back(std::move(scans[k]));
    }
  numbers = std::move(kept_numbers);
  scans = std::move(kept_scans);
}

void FragmentFolder::leave_out_unreadable() {
  std::map<std::size_t, std::string> reasons;
  for (std::size_t k = 0; k < scans.size() && !InterruptGuard::requested(); ++k) try {
      read(k, 0, MeshNote::none);
    } catch (const IoError& error) {
      reasons[k] = error.what();
    }
  leave_out(reasons);
}

std::vector<std::pair<std::string, std::size_t>> PreparedFolder::prepared_sizes() const {
  std::vector<std::pair<std::string, std::size_t>> out;
  for (std::size_t k = 0; k < scans.size(); ++k) out.emplace_back(scans[k].path, clouds[k].size());
  return out;
}

PreparedFolder prepare_folder(const Context& context, const ScanInput& input,
                              const PrepareOptions& options, bool quiet, bool infer_viewpoint) {
  PreparedFolder folder{FragmentFolder(input, quiet)};
  const std::size_t size = folder.numbers.size();
  std::map<std::size_t, std::string> bad;
  ViewpointNote viewpoints;
  SensorFixedNote sensor_fixed;
  Progress progress("preparing", "fragments", size, quiet);
  for (std::size_t next = 0; next < size;) {
    if (InterruptGuard::requested()) {
      folder.interrupted = true;
      break;
    }
    std::vector<PointCloud> chunk;
    std::vector<std::size_t> places;
    std::vector<std::string> files;
    for (std::size_t points = 0;
         next < size && chunk.size() < kChunkClouds && points < kChunkPoints; ++next) {
      try {
        chunk.push_back(folder.read(next, mesh_spacing(options.voxel_size),
                                    quiet ? MeshNote::none : MeshNote::print));
      } catch (const IoError& error) {
        bad[next] = error.what();
        continue;
      }
      places.push_back(next);
      files.push_back(folder.scans[next].path);
      if (!quiet && options.depth_maps > 0) viewpoints.see(chunk.back(), folder.scans[next].path);
      points += chunk.back().points.size();
    }
    sensor_fixed.leave_out_parts(chunk, files, infer_viewpoint);
    const auto prepared = prepare_usable(context, files, chunk, options, infer_viewpoint);
    for (std::size_t k = 0; k < chunk.size(); ++k) {
      if (!prepared[k].reason.empty()) {
        bad[places[k]] = prepared[k].reason;
        continue;
      }
      folder.clouds.push_back(*prepared[k].cloud);
      sensor_fixed.see(folder.clouds.back().statistics(), files[k]);
      folder.hashes.push_back(hash_of(chunk[k]));
      folder.extent = std::max(folder.extent, extent_of(chunk[k].points));
    }
    progress.update(next);
  }
  folder.seconds = progress.seconds();
  viewpoints.print();
  if (!quiet) sensor_fixed.print();
  if (!folder.interrupted) folder.leave_out(bad);
  return folder;
}

std::vector<std::pair<std::uint32_t, std::uint32_t>> choose_pairs(const FragmentFolder& folder,
                                                                  const std::string& pairs,
                                                                  bool quiet) {
  std::vector<std::pair<std::uint32_t, std::uint32_t>> chosen;
  const auto size = static_cast<std::uint32_t>(folder.numbers.size());
  if (pairs == "all") {
    for (std::uint32_t i = 0; i < size; ++i)
      for (std::uint32_t j = i + 1; j < size; ++j) chosen.emplace_back(i, j);
    return chosen;
  }
  const auto listed = io::read_pairs(pairs, folder.all());
  std::size_t repeated = 0;
  std::set<std::pair<std::uint32_t, std::uint32_t>> seen;
  for (const auto& [i, j] : listed) {
    if (!folder.has(i) || !folder.has(j)) continue;  // unusable
    const std::pair<std::uint32_t, std::uint32_t> pair =
        std::minmax(folder.index_of(i), folder.index_of(j));
    if (seen.insert(pair).second)
      chosen.push_back(pair);
    else
      ++repeated;
  }
  if (repeated > 0 && !quiet)
    std::cerr << "gpureg: note: " << repeated << " of " << listed.size() << " pairs in " << pairs
              << " repeat another one" << std::endl;
  return chosen;
}

void check_pairs(const ScanInput& input, const std::string& pairs) {
  if (choose_pairs(FragmentFolder(input, true), pairs, true).empty() && pairs != "all")
    throw InvalidArgument(pairs + " lists no pair");
}

}  // namespace gpureg::cli
