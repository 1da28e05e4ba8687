// SPDX-License-Identifier: BSD-3-Clause
// PCL's SampleConsensusPrerejective and its template alignment (SampleConsensusInitialAlignment)
// for bench/peers and bench/find: gpureg_pcl_peer [VOXEL]. Says PCL's version, then answers binary
// requests on standard input with lines:
//   'c' n, n points, n normals (float32): a cloud; features of PCL's own, and normals if all are 0,
//   towards the origin. Answer: processor seconds. 'a' source, target, seed: aligns clouds by
//   number. Answer: inlier fraction, processor seconds, peak memory in MiB, 16 numbers. 't': the
//   same, a template with a scene; the first number is minus the mean squared distance.
#include <pcl/features/fpfh_omp.h>
#include <pcl/features/normal_3d_omp.h>
#include <pcl/pcl_config.h>
#include <pcl/point_types.h>
#include <pcl/registration/ia_ransac.h>
#include <pcl/registration/sample_consensus_prerejective.h>
#include <pcl/search/kdtree.h>
#include <sys/resource.h>

#include <algorithm>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <ctime>
#include <vector>

namespace {

float voxel = 0.05f;  // of the clouds that come in

using Points = pcl::PointCloud<pcl::PointNormal>;
using Features = pcl::PointCloud<pcl::FPFHSignature33>;

struct Prepared {
  Points::Ptr points{new Points};
  Features::Ptr features{new Features};
};

double processor_seconds() { return static_cast<double>(std::clock()) / CLOCKS_PER_SEC; }

double peak_memory_mib() {
  rusage usage{};
  getrusage(RUSAGE_SELF, &usage);
  return static_cast<double>(usage.ru_maxrss) / 1024.0;
}

template <typename T>
bool read(std::vector<T>& values) {
  return std::fread(values.data(), sizeof(T), values.size(), stdin) == values.size();
}

bool read_cloud(Prepared& cloud) {
  std::vector<std::uint32_t> size(1);
  if (!read(size)) return false;
  std::vector<float> points(3 * std::size_t{size[0]}), normals(points.size());
  if (!read(points) || !read(normals)) return false;
  for (std::size_t k = 0; k < points.size(); k += 3)
    cloud.points->push_back(pcl::PointNormal(points[k], points[k + 1], points[k + 2], normals[k],
                                             normals[k + 1], normals[k + 2]));
  if (std::any_of(normals.begin(), normals.end(), [](float n) { return n != 0; })) return true;
  pcl::NormalEstimationOMP<pcl::PointNormal, pcl::PointNormal> estimation;
  estimation.setRadiusSearch(4 * voxel);
  estimation.setInputCloud(cloud.points);
  estimation.compute(*cloud.points);
  return true;
}

void compute_features(Prepared& cloud) {
  pcl::FPFHEstimationOMP<pcl::PointNormal, pcl::PointNormal, pcl::FPFHSignature33> estimation;
  estimation.setRadiusSearch(5 * voxel);
  estimation.setInputCloud(cloud.points);
  estimation.setInputNormals(cloud.points);
  estimation.compute(*cloud.features);
}

void answer(double score, double start, const Eigen::Matrix4f& pose) {
  std::printf("%.9g %.6f %.1f", score, processor_seconds() - start, peak_memory_mib());
  for (int row = 0; row < 4; ++row)
    for (int column = 0; column < 4; ++column)
      std::printf(" %.9g", static_cast<double>(pose(row, column)));
  std::printf("\n");
}

/// In voxels what PCL's tutorial on template alignment has in voxels of 5 mm.
void align_template(const Prepared& part, const Prepared& scene, unsigned seed) {
  std::srand(seed);
  const double start = processor_seconds();
  pcl::SampleConsensusInitialAlignment<pcl::PointNormal, pcl::PointNormal, pcl::FPFHSignature33>
      method;
  method.setInputSource(part.points);
  method.setSourceFeatures(part.features);
  method.setInputTarget(scene.points);
  method.setTargetFeatures(scene.features);
  method.setMinSampleDistance(10 * voxel);
  method.setMaxCorrespondenceDistance(2 * voxel);
  method.setMaximumIterations(500);
  Points aligned;
  method.align(aligned);
  const double limit = 2 * static_cast<double>(voxel);
  answer(-method.getFitnessScore(limit * limit), start, method.getFinalTransformation());
}

void align(const Prepared& source, const Prepared& target, unsigned seed) {
  std::srand(seed);  // PCL draws samples by std::rand
  const double start = processor_seconds();
  pcl::SampleConsensusPrerejective<pcl::PointNormal, pcl::PointNormal, pcl::FPFHSignature33> method;
  method.setInputSource(source.points);
  method.setSourceFeatures(source.features);
  method.setInputTarget(target.points);
  method.setTargetFeatures(target.features);
  method.setMaximumIterations(50000);
  method.setNumberOfSamples(3);
  method.setCorrespondenceRandomness(5);
  method.setSimilarityThreshold(0.9f);
  method.setMaxCorrespondenceDistance(2.5f * voxel);
  method.setInlierFraction(0.25f);
  Points aligned;
  method.align(aligned);
  const double fraction = method.hasConverged() ? static_cast<double>(method.getInliers().size()) /
                                                      static_cast<double>(source.points->size())
                                                : 0;
  answer(fraction, start, method.getFinalTransformation());
}

}  // namespace

int main(int argc, char** argv) {
  if (argc > 1) voxel = std::strtof(argv[1], nullptr);
  std::printf("%s\n", PCL_VERSION_PRETTY);
  std::fflush(stdout);
  std::vector<Prepared> clouds;
  for (int request = std::getchar(); request != EOF; request = std::getchar()) {
    if (request == 'c') {
      clouds.emplace_back();
      if (!read_cloud(clouds.back())) return 2;
      const double start = processor_seconds();
      compute_features(clouds.back());
      std::printf("%.6f\n", processor_seconds() - start);
    } else if (request == 'a' || request == 't') {
      std::vector<std::uint32_t> numbers(3);
      if (!read(numbers) || numbers[0] >= clouds.size() || numbers[1] >= clouds.size()) return 2;
      (request == 'a' ? align : align_template)(clouds[numbers[0]], clouds[numbers[1]], numbers[2]);
    } else {
      return 2;
    }
    std::fflush(stdout);
  }
  return 0;
}
