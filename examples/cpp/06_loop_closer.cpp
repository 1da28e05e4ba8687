// SPDX-License-Identifier: BSD-3-Clause
// Loops for a SLAM system: adds fragments one by one, as tracking would, and prints what the closer
// says about loops and poses.
//
//   06_loop_closer POSES.txt CLOUD.ply CLOUD.ply [CLOUD.ply ...]
//
// POSES.txt has a line of 16 numbers for each cloud: world_from_fragment by tracking, row by row.
// Exit status: 0 done, 2 an error.
#include <cstdio>
#include <fstream>
#include <gpureg/gpureg.hpp>
#include <gpureg/io.hpp>
#include <gpureg/loop_closure.hpp>
#include <string>

namespace lc = gpureg::loop_closure;

int main(int argc, char** argv) try {
  if (argc < 4) {
    std::fprintf(stderr, "usage: 06_loop_closer POSES.txt CLOUD.ply CLOUD.ply [CLOUD.ply ...]\n");
    return 2;
  }
  std::ifstream tracked(argv[1]);
  const gpureg::Context context = gpureg::Context::best();
  const lc::Options options{gpureg::RegistrationOptions{0.05f}};
  lc::LoopCloser closer(context, options);

  gpureg::UnalignedIsometry3d last;
  for (int k = 0; k + 2 < argc; ++k) {
    lc::Fragment fragment;
    fragment.id = k;
    fragment.time = k;
    gpureg::UnalignedIsometry3d pose;
    for (int cell = 0; cell < 16; ++cell) tracked >> pose.matrix()(cell / 4, cell % 4);
    if (!tracked) throw gpureg::IoError(std::string(argv[1]) + " has too few poses");
    const gpureg::PointCloud cloud = gpureg::io::read_point_cloud(argv[k + 2]);
    fragment.cloud = gpureg::prepare(context, cloud.view(), options.registration);
    fragment.world_from_fragment = pose;
    closer.add(fragment);
    if (k > 0) closer.add_odometry(k, k - 1, last.inverse() * pose);
    last = pose;

    // Between two frames there are 20 ms to spare; what is left is done later.
    const lc::Update update = closer.process(20.0);
    for (const lc::Loop& loop : update.changed)
      std::printf("%d: loop %ld -> %ld is %s (%s), confidence %.2f\n", k, long(loop.source),
                  long(loop.target), to_string(loop.state), to_string(loop.reason),
                  loop.confidence);
  }
  // At the end there is time for everything. A host with a back end of its own makes a factor of
  // each accepted loop here, and takes it out again when a loop is retracted.
  for (const lc::Loop& loop : closer.process().changed)
    std::printf("end: loop %ld -> %ld is %s (%s)\n", long(loop.source), long(loop.target),
                to_string(loop.state), to_string(loop.reason));
  for (const lc::FragmentPose& pose : closer.poses()) {
    const Eigen::Vector3d p = pose.world_from_fragment.translation();
    std::printf("fragment %ld is at %.3f %.3f %.3f\n", long(pose.id), p.x(), p.y(), p.z());
  }
  return 0;
} catch (const gpureg::Error& error) {
  std::fprintf(stderr, "error: %s\n", error.what());
  return 2;
}
