// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <memory>
#include <vector>

#include "surfel.hpp"

/// A map of surfels: fusion of depth images, correction by the keyframes. CPU and CUDA give the
/// same bits.
namespace surfel {

/// A depth image in host memory, and colour (blue, green, red), or null.
struct Image {
  int width, height;
  const float* depth;  ///< metres, 0: none
  const std::uint8_t* colour;
};

/// How a keyframe moved: world_new_from_world_old.
struct Correction {
  int frame;  ///< number of the keyframe's frame
  Pose motion;
  int session = 0;
};

using Cloud = std::vector<Surfel>;

/// Not thread-safe.
class SurfelMap {
 public:
  virtual ~SurfelMap() = default;
  /// Fuses a frame; numbers ascend. Only surfels that were seen in the last active_frames frames
  /// and not before `since` are associated: older ones may have drifted away.
  virtual void fuse(const Image& image, const Camera& camera, const Pose& world_from_camera,
                    int frame, int since) = 0;
  /// Moves every surfel with the keyframes that observed it. Ascending frames.
  virtual void correct(const std::vector<Correction>& corrections) = 0;
  virtual Cloud download() const = 0;  ///< all surfels, in their order
  virtual void upload(const Cloud& surfels) = 0;
  virtual std::size_t size() const = 0;
};

/// threads: 0: one per core; results do not depend on it.
std::unique_ptr<SurfelMap> make_cpu_map(const Options& options, unsigned threads = 0);
/// Throws std::runtime_error without CUDA in the build or without a device.
std::unique_ptr<SurfelMap> make_cuda_map(const Options& options);
bool cuda_available();

/// At most count surfels, > 0, that cover the same surfaces: of those in one cell that face the
/// same way the most confident one. The cells are as small as the count allows.
Cloud thinned(const Cloud& surfels, std::size_t count);

/// The corrections as correct() of surfel.hpp takes them.
struct Motions {
  explicit Motions(const std::vector<Correction>& corrections);
  std::vector<int> frames, sessions;
  std::vector<MotionSum> sums;  ///< one more than frames
};

}  // namespace surfel
