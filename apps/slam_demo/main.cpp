// SPDX-License-Identifier: BSD-3-Clause
#include <chrono>
#include <iostream>
#include "sequence.hpp"
#include "tracker.hpp"
using namespace slam_demo;
int main(int argc, char** argv) {
  Sequence s = open_sequence(argv[1]);
  Map map;
  TrackerOptions o;
  o.sequential = argc > 2;
  Tracker tracker(map, s.rig.colour, o);
  Extractor extract;
  std::vector<FramePose> poses;
  double load_ms = 0, ex = 0, tr = 0;
  int lost = 0;
  auto now = [] { return std::chrono::steady_clock::now(); };
  auto ms = [](auto a, auto b) { return std::chrono::duration<double, std::milli>(b - a).count(); };
  for (size_t k = 0; k < s.frames.size(); ++k) {
    auto a = now();
    Images im = load(s.frames[k], s.rig);
    auto b = now();
    Features f = extract(im.grey, im.depth);
    auto c = now();
    size_t nf = f.size();
    auto r = tracker.track((int)k, s.frames[k].time, std::move(f), im.grey, im.depth);
    auto d = now();
    load_ms += ms(a, b);
    ex += ms(b, c);
    tr += ms(c, d);
    if (r.pose.session == kNone)
      ++lost;
    else
      poses.push_back(r.pose);
    if (k % 50 == 0 || getenv("DBG"))
      std::cerr << k << " features " << nf << " inliers " << r.inliers << (r.dense ? " dense" : "")
                << " kf " << map.keyframes.size() << " sessions " << tracker.sessions() << "\n";
  }
  tracker.settle();
  Trajectory t;
  for (auto& p : poses)
    t.push_back({p.time, world_from_camera(map, p) * (s.rig.truth_of_depth
                                                          ? s.rig.colour_from_depth
                                                          : Eigen::Isometry3d::Identity())});
  auto ate = absolute_error(s.truth, t);
  double n = s.frames.size();
  std::cout << "ate rmse " << ate.rmse << " max " << ate.max << " lost " << lost << " kf "
            << map.keyframes.size() << " sessions " << tracker.sessions() << " ms load "
            << load_ms / n << " orb " << ex / n << " track " << tr / n << " bundle "
            << tracker.bundle_milliseconds() / n << "\n";
}
