// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <map>
#include <string>
#include <utility>
#include <vector>

#include "gpureg/sets/fragment_set.hpp"
#include "gpureg/sets/pair_journal.hpp"
#include "inputs/cloud_file.hpp"
#include "inputs/scan_input.hpp"
#include "run/viewpoint_note.hpp"

namespace gpureg::cli {

/// A fragment that cannot be read or prepared. It costs its own pairs; the others are as if it were
/// not in the folder.
struct UnusableFragment {
  io::ScanFile scan;
  std::string reason;
};

/// The scans of a folder, a list or a pattern, and their sensor positions of cameras.txt.
class FragmentFolder {
 public:
  FragmentFolder() = default;
  /// @param quiet does not say what was skipped, and where cameras.txt and the scans do not match.
  /// @throws IoError.
  FragmentFolder(const ScanInput& input, bool quiet);

  std::vector<int> numbers;  ///< ascending
  std::vector<io::ScanFile> scans;
  std::vector<UnusableFragment> unusable;  ///< in neither of the two any more

  /// All that were there, the unusable ones too, ascending.
  std::vector<io::ScanFile> all() const;

  /// What Redwood's files give as the number of fragments; larger than the number of files where
  /// numbers are missing.
  int count() const { return count_; }
  bool has(int number) const;
  std::uint32_t index_of(int number) const;  ///< of a fragment that is there

  /// Cloud k with its sensor positions: those of cameras.txt, else those of its file. See
  /// read_cloud().
  PointCloud read(std::size_t k, double spacing, MeshNote note) const;

  /// Leaves out the fragments at these ascending places, for the reasons given, and says so on
  /// stderr. Throws IoError where they leave less than a pair.
  void leave_out(const std::map<std::size_t, std::string>& reasons);

 private:
  int count_ = 0;
  std::map<int, std::vector<Eigen::Vector3d>> cameras_;
};

/// The fragments of a folder as the library reads them. The first time that one is read, notes what
/// people should hear of.
class FolderSet : public FragmentSet {
 public:
  /// @param quiet says nothing.
  /// @param infer_viewpoint of fragments without a sensor position, see PointCloudView.
  explicit FolderSet(FragmentFolder folder, bool quiet, bool infer_viewpoint = true);

  std::size_t size() const override { return folder_.numbers.size(); }
  std::string name(std::size_t k) const override { return folder_.scans[k].name; }
  std::string label(std::size_t k) const override { return folder_.scans[k].path; }
  LoadedCloud read(std::size_t k, const RegistrationOptions& options) const override;
  std::string fingerprint(std::size_t k) const override { return seen_[k].fingerprint; }
  std::size_t readers() const override { return 1; }  // what they note has an order

  const FragmentFolder& folder() const { return folder_; }
  double extent(std::size_t k) const { return seen_[k].extent; }  ///< longest side of a fragment

  /// Says on stderr what reading and preparation have noted.
  /// @param scans places of those that could be used.
  void print_notes(const std::vector<std::size_t>& scans,
                   const std::vector<PreparedFragment>& prepared) const;

 private:
  struct Seen {
    std::string fingerprint;
    double extent = 0;
  };
  FragmentFolder folder_;
  bool quiet_, infer_viewpoint_;
  mutable std::vector<Seen> seen_;
  mutable ViewpointNote viewpoints_;
};

/// What the preparation of the fragments of a folder says about the voxel size.
struct PreparedSizes {
  double extent = 0;  ///< longest side of the largest fragment
  std::vector<std::pair<std::string, std::size_t>> points;  ///< file, number of prepared points
};
PreparedSizes sizes_of(const FolderSet& set, const std::vector<std::size_t>& scans,
                       const std::vector<PreparedFragment>& prepared);

/// The fragments of a folder, prepared; the raw clouds are let go as soon as they are.
struct PreparedFolder : FragmentFolder {
  std::vector<PreparedCloud> clouds;
  RunIdentity identity;  ///< without settings
  PreparedSizes sizes;
  double seconds = 0;
  bool interrupted = false;  ///< stopped before all were prepared
};

/// Reads and prepares all fragments, and says on stderr which are left out as unusable.
/// infer_viewpoint: of fragments without a sensor position, see PointCloudView. Throws IoError,
/// also where unusable fragments leave less than a pair.
PreparedFolder prepare_folder(const Context& context, const ScanInput& input,
                              const RegistrationOptions& options, bool quiet,
                              bool infer_viewpoint = true);

/// Reads cameras.txt and a list of pairs before the clouds are read. Throws IoError as
/// choose_pairs(), InvalidArgument for a list without a pair.
void check_pairs(const ScanInput& input, const std::string& pairs);

/// Pairs of a target i and a source j > i, as indices into numbers, in the file's order without
/// repetitions, or all of them for "all". Pairs of unusable fragments are left out. Unless quiet,
/// says how many are repetitions. Throws IoError for a number that no fragment has.
std::vector<Pair> choose_pairs(const FragmentFolder& folder, const std::string& pairs, bool quiet);

}  // namespace gpureg::cli
