// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "gpureg/registration.hpp"
#include "gpureg/verification.hpp"

/// Component `localization`: where in a map a scan is, or that it is not there. Every function is
/// deterministic and thread-safe unless it says otherwise.
namespace gpureg::localization {

/// Options of a map. Lengths are in voxels.
struct MapOptions {
  float voxel_size = 0.05f;     ///< in the unit of the points, > 0
  PrepareOptions prepare = {};  ///< of the map's tiles and of the scans
  double tile_size = 400;       ///< largest edge of a tile, > 0. A scan is aligned with every tile.
  /// A tile also has the points of its neighbours within this distance, >= 0: about half of the
  /// extent of a scan.
  double halo = 80;

  /// @throws InvalidArgument naming field and value.
  void validate() const;
};

struct MapState;

/// A map that scans are located in: the mean point of each voxel with the side that it was seen
/// from, sensor positions, and overlapping tiles. An immutable handle: copies share the data, and
/// threads may share copies. Tiles are prepared when the first scan needs them; those of up to a
/// million points together stay prepared.
///
/// The accessors throw InvalidArgument on an empty handle.
class PreparedMap {
 public:
  PreparedMap() = default;  ///< empty handle

  bool valid() const { return state_ != nullptr; }  ///< false for an empty handle
  std::size_t size() const;                         ///< number of points: voxels
  std::size_t tiles() const;                        ///< number of tiles
  const MapOptions& options() const;

  /// @return a copy of the points, with normals if the sides of surfaces are known, and the
  ///   sensor positions.
  PointCloud cloud() const;

  /// Writes the map into one file, all or nothing: a full disk leaves an old file as it was.
  /// @throws IoError naming the file and the reason.
  void save(const std::string& path) const;

  /// Reads a file of save(). Scans are located in it as in the map that was saved, bit for bit.
  /// @throws IoError naming the file and the reason: missing, another kind of file, another
  ///   version, truncated, damaged.
  static PreparedMap load(const std::string& path);

  /// @return true if the file begins as those of save() do.
  /// @throws IoError if it cannot be read.
  static bool is_saved(const std::string& path);

 private:
  friend struct MapState;
  explicit PreparedMap(std::shared_ptr<const MapState> state) : state_(std::move(state)) {}
  std::shared_ptr<const MapState> state_;
};

/// Makes a map from scans or pieces of a cloud, one in memory at a time: memory grows with the
/// surface of the map. Not thread-safe.
class MapBuilder {
 public:
  /// @throws InvalidArgument as MapOptions::validate().
  explicit MapBuilder(const MapOptions& options);
  ~MapBuilder();
  MapBuilder(MapBuilder&&) noexcept;
  MapBuilder& operator=(MapBuilder&&) noexcept;

  /// Adds a scan. Its viewpoints, given or inferred as prepare() does, tell the sides of its
  /// surfaces and become sensor positions of the map.
  /// @param map_from_scan p_map = map_from_scan * p_scan, metres.
  /// @throws InvalidArgument as prepare(), and for a pose that is no rigid motion.
  void add_scan(const Context& context, const PointCloudView& scan,
                const UnalignedIsometry3d& map_from_scan);

  /// Adds a cloud, or a piece of one, in the frame of the map. Sides of surfaces are those of its
  /// normals; its viewpoints become sensor positions.
  /// @throws InvalidArgument as PointCloudView::validate().
  void add_cloud(const PointCloudView& cloud);

  /// @return the map of what was added. If nothing tells the sides of its surfaces, they are
  ///   inferred for the search of places, on all cores: the sensor is taken to have been on the
  ///   side of a surface on which most of its surroundings lie.
  /// @throws InvalidArgument for a map without points.
  PreparedMap build() const;

 private:
  struct State;
  std::unique_ptr<State> state_;
};

/// The map of one cloud.
/// @throws InvalidArgument as MapBuilder.
PreparedMap prepare_map(const PointCloudView& cloud, const MapOptions& options = {});

/// Options of locate(). Lengths are in voxels of the map.
struct LocateOptions {
  /// Of the alignments, with the voxel size of the map. Its min_confidence is not used, and a
  /// calibration is refused: both are of pairs.
  RegistrationOptions registration = {};
  /// Confidence from which a place is found. It is higher than that of pairs: a map offers many
  /// places to a scan that is not in it.
  double min_confidence = 0.75;
  /// If the view from above does not tell the place, all tiles are searched with voxels this
  /// many times as wide as those of the map, 1..8: several times as fast, and thinned scans of
  /// spinning LiDARs find more. 1: with those of the map.
  double coarse_factor = 2;
  /// In a map of more tiles, all are searched in voxels twice as wide again first, and at most
  /// this many in coarse ones, >= 1: those in which that search was the most confident. Scans with
  /// less than a thousand points in its voxels are searched in all tiles in coarse ones.
  std::uint32_t coarse_tiles = 8;
  /// If the coarse search does not end in a place with a confidence of 0.75, at most
  /// this many tiles are searched with the voxels of the map, >= 1: those in which the coarse
  /// search was the most confident. None if no pose of it reaches 0.1, of a scan with a thousand
  /// coarse points: the scan is not in the map.
  std::uint32_t fine_tiles = 4;
  /// Poses of a scan that are verified against all of the map around them, 1..64.
  std::uint32_t candidates = 8;
  /// Distance from the points of the scan up to which the map takes part in this, > 0.
  double neighborhood = 10;

  /// @throws InvalidArgument naming field and value.
  void validate() const;
};

/// Approximate position of a scan.
struct PositionPrior {
  /// Of the origin of the scan's frame in the map, metres, at most 1e12.
  Eigen::Vector3d position = Eigen::Vector3d::Zero();
  double radius = 5;  ///< largest distance from it, metres, > 0
};

/// Prior knowledge of the pose of one scan. Poses that contradict it are not considered.
struct LocatePrior {
  std::optional<GravityPrior> gravity;  ///< the source is the scan, the target the map
  std::optional<PositionPrior> position;

  /// @param name prefix of the field in error messages.
  /// @throws InvalidArgument naming field and value.
  void validate(const std::string& name = "prior") const;
};

enum class LocateStatus : std::uint8_t {
  found,      ///< poses.front() reaches min_confidence
  ambiguous,  ///< only several places that look alike reach it together: poses with alias
  not_found   ///< not in this map, or not recognised: see absent_probability
};
const char* to_string(LocateStatus status);  ///< "not_found", ...

/// The search that a result comes from: each one runs if the one before is not sure.
enum class SearchStage : std::uint8_t {
  from_above,    ///< scan and map seen from above
  coarse_tiles,  ///< tiles of the map, in coarse voxels
  tiles          ///< the best tiles, in the voxels of the map
};
const char* to_string(SearchStage stage);  ///< "from_above", ...

/// A pose of a scan in a map.
struct LocatedPose {
  UnalignedIsometry3d map_from_scan = no_pose();
  /// Probability that the pose is correct, in view of all other places.
  double confidence = 0;
  /// The scan fits here about as well as at the first pose, which is elsewhere.
  bool alias = false;
  /// Verification against the map around the pose; its confidence leaves other places aside. If
  /// the view from above was enough, it is by surfaces alone: match_inliers, match_support and
  /// overlap_confidence tell nothing.
  PoseVerification verification;
};

/// Result of one scan. A plain value.
struct LocateResult {
  LocateStatus status = LocateStatus::not_found;
  std::vector<LocatedPose> poses;  ///< the most confident first, all of different places
  /// Probability that none of the poses is correct: the scan is not in this map, or its place was
  /// not among the candidates.
  double absent_probability = 1;
  std::size_t scan_points = 0;  ///< prepared points of the scan
  SearchStage stage = SearchStage::from_above;
  std::size_t tiles = 0;                ///< that the scan was aligned with
  std::size_t neighborhood_points = 0;  ///< points of the map around the first pose
};

/// Finds the poses of scans in a map. First it looks at both from above, along the most frequent
/// normal of the map and along those of the scan, and finds the places where most walls coincide
/// (after Olson, "Real-time correlative scan matching", ICRA 2009), of all cells and headings. The
/// best are verified against the whole map around them. If that is not sure, the scan is aligned
/// with every tile in coarse voxels, the poses of all tiles are merged, and the most confident ones
/// are verified; if none is sure, but one is possible, the best tiles are searched in the voxels
/// of the map, too. All places compete for the confidence. A part of the scan that the map lacks,
/// or that sees through what the map has, makes a place less likely.
///
/// @param scans host memory; viewpoints as for prepare().
/// @param priors one per scan, or none.
/// @param names of the scans in error messages, or none.
/// @return one result per scan. The same bits on every backend, for any number of threads, and for
///   any other scans of the call.
/// @throws InvalidArgument as prepare() and align(), for an empty map, for options whose voxel size
///   is not that of the map, and for a scan that looks as if it was in another unit.
/// @throws DeviceError if the device fails.
std::vector<LocateResult> locate(const Context& context, const std::vector<PointCloudView>& scans,
                                 const PreparedMap& map, const LocateOptions& options,
                                 const std::vector<LocatePrior>& priors = {},
                                 const std::vector<std::string>& names = {});

/// The same for one scan, with the options of the map's voxel size.
LocateResult locate(const Context& context, const PointCloudView& scan, const PreparedMap& map,
                    const LocatePrior& prior = {});

}  // namespace gpureg::localization
