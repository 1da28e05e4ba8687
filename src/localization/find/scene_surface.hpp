// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <limits>
#include <vector>

namespace gpureg::localization {

/// The points that a sensor saw, by direction.
class SceneView {
 public:
  SceneView(const std::vector<Eigen::Vector3f>& points, const Eigen::Vector3f& viewpoint);

  const Eigen::Vector3f& viewpoint() const { return viewpoint_; }

  /// Calls visit(point relative to the viewpoint) for all points within the cone, and some around.
  template <typename Visit>
  void visit_cone(const Eigen::Vector3f& direction, float cosine, float sine,
                  const Visit& visit) const {
    // Cosine of the angle of the cone and a bin together.
    const float wide = cosine * kBinCosine - sine * kBinSine;
    for (const Bin& bin : bins_)
      if (bin.direction.dot(direction) >= wide)
        for (std::uint32_t k = bin.begin; k < bin.end; ++k) visit(points_[k]);
  }

 private:
  /// Cells along an edge of the cube around the viewpoint; a cell extends over less than 2.6
  /// degrees from its middle.
  static constexpr int kBins = 32;
  static constexpr float kBinCosine = 0.99897f, kBinSine = 0.04536f;
  struct Bin {
    Eigen::Vector3f direction;
    std::uint32_t begin, end;
  };
  Eigen::Vector3f viewpoint_;
  std::vector<Eigen::Vector3f> points_;  ///< by bin
  std::vector<Bin> bins_;
};

/// The surface of a scene as small discs.
class SceneSurface {
 public:
  /// @param normals unit, or zero where not known.
  /// @param reach of nearest().
  SceneSurface(std::vector<Eigen::Vector3f> points, std::vector<Eigen::Vector3f> normals,
               bool oriented, float reach);

  static constexpr std::uint32_t kNone = std::numeric_limits<std::uint32_t>::max();
  struct Nearest {
    std::uint32_t index = kNone;
    float along = 0;  ///< distance from the plane of the disc, signed by its normal
  };
  /// Of the discs within reach whose normal is similar, the nearest one.
  Nearest nearest(const Eigen::Vector3f& point, const Eigen::Vector3f& normal,
                  float min_cosine) const;

  std::size_t size() const { return points_.size(); }
  /// Cubes as wide as the reach that hold points: poses that share these share surface.
  std::uint32_t block(std::size_t k) const { return blocks_[k]; }
  std::size_t blocks() const { return block_count_; }
  const Eigen::Vector3f& point(std::size_t k) const { return points_[k]; }
  const Eigen::Vector3f& normal(std::size_t k) const { return normals_[k]; }
  bool oriented() const { return oriented_; }

 private:
  struct Bucket {
    std::uint64_t key = ~std::uint64_t{0};
    std::uint32_t begin = 0, end = 0;
  };
  void number_blocks();
  const Bucket* bucket_of(std::uint64_t key) const;

  std::vector<Eigen::Vector3f> points_, normals_;  ///< by cell
  std::vector<std::uint32_t> blocks_;              ///< of each point
  std::size_t block_count_ = 0;
  bool oriented_;
  float reach_, inverse_;
  std::vector<Bucket> table_;  ///< open addressing, a power of two
};

}  // namespace gpureg::localization
