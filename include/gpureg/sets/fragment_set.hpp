// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "gpureg/context.hpp"
#include "gpureg/options.hpp"
#include "gpureg/point_cloud.hpp"
#include "gpureg/prepared_cloud.hpp"

/// Component `sets`: sets of clouds that are read when they are needed.
namespace gpureg {

/// A cloud that was read.
struct LoadedCloud {
  PointCloudView view;
  std::shared_ptr<const void> owner;  ///< of the memory of the view

  LoadedCloud() = default;
  explicit LoadedCloud(PointCloud cloud);
};

/// Clouds that are read one by one. A file that cannot be read, or a cloud that cannot be prepared,
/// costs its own pairs; the others are as if it were not there.
class FragmentSet {
 public:
  virtual ~FragmentSet() = default;

  virtual std::size_t size() const = 0;
  virtual std::string name(std::size_t k) const = 0;  ///< unique
  /// What messages call it, as the path of its file.
  virtual std::string label(std::size_t k) const { return name(k); }

  /// Reads fragment k for a preparation by these options, of which meshes take the spacing of their
  /// samples. Called by several threads at a time.
  /// @throws IoError if it cannot be read.
  virtual LoadedCloud read(std::size_t k, const RegistrationOptions& options) const = 0;
  /// Tells whether fragment k is the one that an earlier run saw. Called after it was read. By
  /// default fingerprint_of() the cloud, which reads it again.
  virtual std::string fingerprint(std::size_t k) const;
  /// How many threads read at a time.
  virtual std::size_t readers() const { return 4; }
};

/// A hash of all points, normals, viewpoints and the origin of a cloud, as text.
std::string fingerprint_of(const PointCloudView& cloud);

/// Fragments of a function, as one that reads the file of that index.
class FragmentsOf : public FragmentSet {
 public:
  FragmentsOf(std::vector<std::string> names, std::function<PointCloud(std::size_t)> read)
      : names_(std::move(names)), read_(std::move(read)) {}

  std::size_t size() const override { return names_.size(); }
  std::string name(std::size_t k) const override { return names_[k]; }
  LoadedCloud read(std::size_t k, const RegistrationOptions&) const override {
    return LoadedCloud(read_(k));
  }

 private:
  std::vector<std::string> names_;
  std::function<PointCloud(std::size_t)> read_;
};

/// A fragment of a set, ready for alignment.
struct PreparedFragment {
  PreparedCloud cloud;           ///< an empty handle: it cannot be used
  std::string reason;            ///< why not
  std::size_t fixed_points = 0;  ///< left out as fixed to the sensor, see find_fixed_parts()

  bool usable() const { return cloud.valid(); }
};

/// The handles alone.
std::vector<PreparedCloud> clouds_of(const std::vector<PreparedFragment>& fragments);

/// Progress and cancellation of long calls. Both run on the calling thread, and either may be
/// empty.
struct SetCallbacks {
  std::function<void(std::size_t done)> on_progress;
  /// true ends the call.
  std::function<bool()> should_stop;
};

/// Reads and prepares all fragments of a set, without the parts that are fixed to the sensor. The
/// raw clouds are let go as soon as they are prepared.
/// @return one per fragment; fewer, if should_stop ended the call.
/// @throws InvalidArgument for options out of range. DeviceError.
std::vector<PreparedFragment> prepare_all(const Context& context, const FragmentSet& fragments,
                                          const RegistrationOptions& options = {},
                                          const SetCallbacks& callbacks = {});

}  // namespace gpureg
