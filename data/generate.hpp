// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <functional>
#include <string>

/// Synthetic furnished rooms, scanned by a simulated hand-held Kinect: data of the project's own,
/// with exact ground truth.
namespace gpureg::synthetic {

/// The depth camera: 640 x 480, f = 525 px, principal point (319.5, 239.5), as in the TUM
/// sequences.
struct SensorOptions {
  double min_depth = 0.4;    ///< metres; nearer surfaces return nothing
  double max_depth = 4.0;    ///< metres; farther surfaces return nothing
  double pixel_shift = 0.5;  ///< sigma in pixels of the random lookup shift (Barron & Malik 2013)
  double disparity_noise =
      1.0 / 6.0;  ///< sigma in disparity steps, before rounding to a step (Barron & Malik 2013)
  /// amplitude of the smooth depth distortion, relative to the depth, at 3 m; grows linearly
  double distortion = 0.007;
  double odometry_translation =
      0.0002;  ///< drift inside a fragment: sigma in metres per frame and axis
  double odometry_rotation_degrees =
      0.01;  ///< drift inside a fragment: sigma in degrees per frame and axis
};

/// A 2-D scanner, 0.3 m above the floor.
struct PlanarScannerOptions {
  double step = 0;      ///< 0: the depth camera; else degrees between readings, 0.05 .. 5
  double field = 360;   ///< degrees, 30 .. 360
  double range = 12;    ///< metres, 1 .. 100
  double noise = 0.01;  ///< sigma of the ranges, metres, 0 .. 1
};

struct GenerateOptions {
  int fragments = 20;            ///< 1 .. 10000; about 0.7 MB of memory each
  int frames_per_fragment = 50;  ///< 1 .. 1000; the camera moves about 1.5 cm per frame
  std::uint64_t seed = 1;        ///< building, furniture, path and noise all follow from it
  /// Instead of a house: "office" or "warehouse", with repeated furniture (house.hpp), or a mesh to
  /// scan: metres, z up (glTF and COLLADA: as the file
  /// has it), floor at z = 0, one storey. Any format that Assimp reads. In the colour images every
  /// connected part has a texture of its own, from the seed, in the colours of the file.
  std::string building;
  /// 0 .. 2, with a mesh: pieces of furniture per square metre that are put into it, so that what
  /// was copied in it differs
  double clutter = 0;
  /// The house at another time: 0: as built; another number: a third of the furniture is moved,
  /// taken away or added, and small boxes; another path and noise.
  std::uint64_t rearrangement = 0;
  /// 0 .. 1000 metres: the path does not come back to a place before this length; of some random
  /// paths the first that does so is taken
  double no_return = 0;
  /// also write the frames as a TUM sequence (about 0.6 MB and several times the work per frame)
  bool rgbd = false;
  int threads = 0;  ///< 0: all cores; each holds one fragment's volume (about 100 MB)
  SensorOptions sensor;
  /// Instead of the camera: every fragment is one scan, of the first frame.
  PlanarScannerOptions scanner;
};

struct Progress {
  /// done of total fragments in the named stage ("fragments", "ground truth"). Called from one
  /// thread at a time, not always the same.
  std::function<void(int done, int total, const char* stage)> report;
  /// Polled before each frame and each row of pairs by any thread, so it must be thread-safe.
  std::function<bool()> should_stop;
};

/// Writes a scene into out_folder (created when missing; files of the same name are replaced):
///   cloud_bin_<i>.ply   binary float32 x y z in the fragment's frame (its first camera: x right, y
///   down, z forward), metres gt.log, gt.info     the pairs i < j with overlap >= 30 % (Redwood's
///   order and factor 2; points of fragment j) gt_all.log/.info    the pairs with overlap >= 5 %;
///   gt_overlap.txt: `i j max min` of both directions, for all pairs poses.txt           fragment
///   number and world_from_fragment (exact);  world: z up, floor at z = 0 cameras.txt `fragment
///   frame tx ty tz qx qy qz qw`: fragment_from_camera as the (drifting) odometry has it
/// and with rgbd: rgb/, depth/ (16 bit, 5000 per metre), rgb.txt, depth.txt, associations.txt,
/// groundtruth.txt (world_from_camera, exact), camera.yaml, surface.ply (the surfaces in view,
/// exact points and normals about 1 cm apart, world). Overlap of A with B is the share of A's
/// points with a point of B within 7.5 cm, under the exact poses.
///
/// The same seed and options give the same bytes for any number of threads, and the scene of N
/// fragments begins with the scene of fewer. Throws InvalidArgument (option out of range, a
/// building in which nobody can walk), BackendUnavailable (a building, but this build is without
/// Assimp) and IoError (building cannot be read; folder cannot be written, disk full, clouds of a
/// larger scene in the folder). When should_stop says so it returns early, without an exception:
/// what is there is complete files, but no gt.log.
void generate(const std::string& out_folder, const GenerateOptions& options,
              const Progress& progress = {});

}  // namespace gpureg::synthetic
