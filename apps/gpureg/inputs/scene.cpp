// SPDX-License-Identifier: BSD-3-Clause
#include "inputs/scene.hpp"

#include <algorithm>
#include <filesystem>
#include <iostream>
#include <map>
#include <set>

#include "gpureg/error.hpp"
#include "gpureg/io.hpp"
#include "gpureg/sets/register_all.hpp"
#include "inputs/cloud_file.hpp"
#include "run/interrupt.hpp"
#include "run/progress.hpp"
#include "run/sensor_fixed_note.hpp"
#include "run/spacing.hpp"
#include "run/viewpoint_note.hpp"

namespace gpureg::cli {
namespace {

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

FolderSet::FolderSet(FragmentFolder folder, bool quiet, bool infer_viewpoint)
    : folder_(std::move(folder)),
      quiet_(quiet),
      infer_viewpoint_(infer_viewpoint),
      seen_(folder_.numbers.size()) {}

LoadedCloud FolderSet::read(std::size_t k, const RegistrationOptions& options) const {
  Seen& seen = seen_[k];
  const bool first = seen.fingerprint.empty(), tell = first && !quiet_;
  PointCloud cloud =
      folder_.read(k, mesh_spacing(options.voxel_size), tell ? MeshNote::print : MeshNote::none);
  if (tell && options.prepare.depth_maps > 0) viewpoints_.see(cloud, folder_.scans[k].path);
  const bool infer_viewpoint = infer_viewpoint_ || !cloud.viewpoints.empty();
  if (first)
    seen = {fingerprint_of(cloud.view()) + (infer_viewpoint ? "" : " without viewpoint"),
            extent_of(cloud.points)};
  LoadedCloud loaded(std::move(cloud));
  loaded.view.infer_viewpoint = infer_viewpoint;
  return loaded;
}

void FolderSet::print_notes(const std::vector<std::size_t>& scans,
                            const std::vector<PreparedFragment>& prepared) const {
  viewpoints_.print();
  if (quiet_) return;
  SensorFixedNote note;
  for (std::size_t k = 0; k < prepared.size(); ++k)
    note.see(prepared[k], folder_.scans[scans[k]].path);
  note.print();
}

PreparedSizes sizes_of(const FolderSet& set, const std::vector<std::size_t>& scans,
                       const std::vector<PreparedFragment>& prepared) {
  PreparedSizes sizes;
  for (std::size_t k = 0; k < prepared.size(); ++k) {
    sizes.extent = std::max(sizes.extent, set.extent(scans[k]));
    sizes.points.emplace_back(set.label(scans[k]), prepared[k].cloud.size());
  }
  return sizes;
}

PreparedFolder prepare_folder(const Context& context, const ScanInput& input,
                              const RegistrationOptions& options, bool quiet,
                              bool infer_viewpoint) {
  const FolderSet set(FragmentFolder(input, quiet), quiet, infer_viewpoint);
  PreparedFolder folder{set.folder(), {}, {}, {}};
  Progress progress("preparing", "fragments", set.size(), quiet);
  std::vector<PreparedFragment> all =
      prepare_all(context, set, options,
                  {[&](std::size_t done) { progress.update(done); }, InterruptGuard::requested});
  folder.seconds = progress.seconds();
  folder.interrupted = all.size() < set.size();
  std::vector<std::size_t> scans;
  std::vector<PreparedFragment> usable;
  std::map<std::size_t, std::string> bad;
  for (std::size_t k = 0; k < all.size(); ++k)
    if (all[k].usable()) {
      scans.push_back(k);
      usable.push_back(std::move(all[k]));
      folder.identity.clouds.push_back({set.name(k), set.fingerprint(k)});
    } else {
      bad[k] = all[k].reason;
    }
  folder.clouds = clouds_of(usable);
  folder.sizes = sizes_of(set, scans, usable);
  set.print_notes(scans, usable);
  if (!folder.interrupted) folder.leave_out(bad);
  return folder;
}

std::vector<Pair> choose_pairs(const FragmentFolder& folder, const std::string& pairs, bool quiet) {
  if (pairs == "all") return all_pairs(folder.numbers.size());
  std::vector<Pair> chosen;
  const auto listed = io::read_pairs(pairs, folder.all());
  std::size_t repeated = 0;
  std::set<std::pair<std::uint32_t, std::uint32_t>> seen;
  for (const auto& [i, j] : listed) {
    if (!folder.has(i) || !folder.has(j)) continue;  // unusable
    const std::pair<std::uint32_t, std::uint32_t> pair =
        std::minmax(folder.index_of(i), folder.index_of(j));
    if (seen.insert(pair).second)
      chosen.push_back({pair.second, pair.first});
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
