// SPDX-License-Identifier: BSD-3-Clause
#include "loops/loops.hpp"

#include <algorithm>
#include <gpureg/registration.hpp>
#include <limits>

#include "stopwatch.hpp"

namespace slam_demo {
namespace {

namespace lc = gpureg::loop_closure;

constexpr int kCovisible = 30;          // shared points that connect two fragments
constexpr std::size_t kNeighbours = 6;  // keyframes on each side that look for image loops
// Metres that a loop must move a keyframe for a full adjustment; the last one is made anyway.
constexpr double kWorthBundle = 0.02;
constexpr int kLoneInliers = 50;      // that make a loop without registration
constexpr int kImageLoops = 1 << 20;  // numbers of loops by images alone begin here
// Where images look for loops in their own session: frames ago, metres, cosine between the views.
constexpr int kLoopFrames = 150;
constexpr double kImageMetres = 3, kImageCosine = 0.5;
// Bounds of the drift of tracking: metres, metres of each metre, radians.
constexpr double kDriftMetres = 0.2, kDriftShare = 0.02, kDriftRadians = 0.2;
// Surfaces over many frames hold a registered pair better than LoopCloser states, which speaks of
// single registrations with correlated points: a third of its standard deviation.
constexpr double kDenseCertainty = 9;
constexpr double kViewDistance = 2;  // metres of the surfaces: what a turn moves in a view
// What a registered loop may differ from the adjusted poses of its keyframes: beyond, something is
// wrong with the fragments, and the pose that all else agrees on is the better one.
constexpr double kMisfitMetres = 0.1, kMisfitRadians = 0.05;

}  // namespace

LoopClosing::LoopClosing(const gpureg::Context& context, Map& map, const Pinhole& camera,
                         const LoopOptions& options)
    : context_(context),
      map_(map),
      camera_(camera),
      options_(options),
      closer_options_([&] {
        auto o = lc::Options::from_voxel_size(options.voxel_size);
        o.optimize = false;  // the keyframes are optimised here
        o.registration.seed = options.seed;
        return o;
      }()),
      closer_(context, closer_options_) {}

/// A keyframe and those that share points with it by tracking: what another loop connects goes
/// with that loop.
std::vector<int> LoopClosing::with_neighbours(int keyframe) const {
  std::vector<int> result = by_count(map_.tracked_covisible(keyframe));
  result.resize(std::min(result.size(), kNeighbours));
  result.insert(result.begin(), keyframe);
  return result;
}

/// Keyframes that may show the place of this one: of other sessions while nothing connects its own
/// to an earlier one, and, where the options say so, of its session's past near by.
std::vector<int> LoopClosing::image_candidates(int index) const {
  const std::vector<int> world = graph_.world_of_session(map_);
  const Keyframe& keyframe = map_.keyframes[at(index)];
  const bool alone =
      options_.sessions && keyframe.session > 0 && world[at(keyframe.session)] == keyframe.session;
  std::vector<int> result;
  for (int k = 0; k < index; ++k) {
    const Keyframe& other = map_.keyframes[at(k)];
    if (world[at(other.session)] != world[at(keyframe.session)]) {
      if (alone) result.push_back(k);
      continue;
    }
    if (!options_.images || other.frame > keyframe.frame - kLoopFrames ||
        keyframe.covisible.count(k) != 0)
      continue;
    const Eigen::Isometry3d motion = keyframe.world_from_camera.inverse() * other.world_from_camera;
    if (motion.translation().norm() < kImageMetres && motion.linear()(2, 2) > kImageCosine)
      result.push_back(k);
  }
  return result;
}

/// Repeated furniture looks alike: no tracking drifts as far as to the next chair.
bool LoopClosing::plausible(const RelativePose& loop) const {
  const Keyframe &a = map_.keyframes[at(loop.a)], &b = map_.keyframes[at(loop.b)];
  const std::vector<int> world = graph_.world_of_session(map_);
  if (world[at(a.session)] != world[at(b.session)]) return true;
  double path = 0;
  for (std::size_t k = at(std::min(loop.a, loop.b)); k < at(std::max(loop.a, loop.b)); ++k)
    path += (map_.keyframes[k + 1].world_from_camera.translation() -
             map_.keyframes[k].world_from_camera.translation())
                .norm();
  const Eigen::Isometry3d change =
      loop.a_from_b.inverse() * a.world_from_camera.inverse() * b.world_from_camera;
  return change.translation().norm() < kDriftMetres + kDriftShare * path &&
         Eigen::AngleAxisd(change.linear()).angle() < kDriftRadians;
}

bool LoopClosing::search_images(int index) {
  const std::vector<int> candidates = image_candidates(index);
  if (candidates.empty()) return false;
  std::optional<ImageLoop> found;
  {
    const Stopwatch watch(time_.image);
    found = image_loop_anywhere(map_, camera_, index, candidates, kLoneInliers);
  }
  if (!found || !plausible(found->edge)) return false;
  const int number = kImageLoops + image_loops_++;
  graph_.add(number, {found->edge});
  image_records_.push_back({index, found->edge.a, found->inliers, found->edge.a_from_b, false});
  // Poses first: an observation of a point of another world would not fit.
  optimize();
  for (const auto& [key, point] : found->matches) map_.add_observation(point, {index, key, number});
  adjust_if_moved();
  return true;
}

void LoopClosing::add_fragment(const BuiltFragment& built) {
  if (!options_.dense) return;
  gpureg::PreparedCloud cloud;
  {
    const Stopwatch watch(time_.prepare);
    cloud = gpureg::prepare(context_, built.cloud.view(), closer_options_.registration.prepare);
  }
  const int id = static_cast<int>(fragments_.size());
  const Keyframe& keyframe = map_.keyframes[at(built.keyframe)];
  lc::Fragment fragment;
  fragment.id = id;
  fragment.session = keyframe.session;
  fragment.time = built.time;
  fragment.cloud = cloud;
  fragment.world_from_fragment = unaligned(keyframe.world_from_camera);
  closer_.add(fragment);
  fragments_.push_back({built.keyframe, built.first_frame, built.last_frame, built.time});
  if (id > 0) {
    const Keyframe& before = map_.keyframes[at(fragments_[at(id - 1)].keyframe)];
    if (before.session == keyframe.session && fragments_[at(id - 1)].keyframe != built.keyframe)
      closer_.add_odometry(
          id, id - 1, unaligned(before.world_from_camera.inverse() * keyframe.world_from_camera));
  }
  std::vector<lc::FragmentId> covisible;
  for (int other = 0; other < id; ++other) {
    if (fragments_[at(other)].kept && shares_points(built.keyframe, fragments_[at(other)]))
      covisible.push_back(other);
  }
  if (!covisible.empty()) closer_.set_covisible(id, covisible);
}

/// Tracking connects a keyframe with one of a fragment.
bool LoopClosing::shares_points(int keyframe, const Fragment& fragment) const {
  for (const auto& [other, shared] : map_.keyframes[at(keyframe)].covisible) {
    const int frame = map_.keyframes[at(other)].frame;
    if (shared >= kCovisible && frame >= fragment.first_frame && frame <= fragment.last_frame)
      return true;
  }
  return false;
}

int LoopClosing::number_of(int source, int target) {
  for (std::size_t k = 0; k < records_.size(); ++k) {
    if (records_[k].source == source && records_[k].target == target) return static_cast<int>(k);
  }
  LoopRecord record;
  record.source = source;
  record.target = target;
  record.source_keyframe = fragments_[at(source)].keyframe;
  record.target_keyframe = fragments_[at(target)].keyframe;
  record.source_time = fragments_[at(source)].time;
  record.target_time = fragments_[at(target)].time;
  records_.push_back(record);
  return static_cast<int>(records_.size()) - 1;
}

/// The later keyframe and those that share points with it, put to where the loop says, look for
/// the points that the earlier ones see.
void LoopClosing::connect_image_loops(int number, const lc::Loop& loop, LoopRecord& record) {
  const Stopwatch watch(time_.image);
  Eigen::Isometry3d target_from_source(loop.target_from_source.matrix());
  int moved = record.source_keyframe, still = record.target_keyframe;
  if (map_.keyframes[at(moved)].time < map_.keyframes[at(still)].time) {
    std::swap(moved, still);
    target_from_source = target_from_source.inverse();
  }
  const std::vector<int> targets = with_neighbours(still);
  const Eigen::Isometry3d correction = map_.keyframes[at(still)].world_from_camera *
                                       target_from_source *
                                       map_.keyframes[at(moved)].world_from_camera.inverse();
  std::vector<RelativePose> edges;
  for (const int k : with_neighbours(moved)) {
    if (std::find(targets.begin(), targets.end(), k) != targets.end()) continue;
    const auto found = image_loop_near(
        map_, camera_, k, correction * map_.keyframes[at(k)].world_from_camera, targets);
    if (!found) continue;
    edges.push_back(found->edge);
    for (const auto& [key, point] : found->matches) map_.add_observation(point, {k, key, number});
    ++record.image_loops;
  }
  graph_.add(number, edges);
}

void LoopClosing::optimize() {
  {
    const Stopwatch watch(time_.graph);
    const std::string reason = graph_.optimize(map_);
    if (!reason.empty()) notes.push_back("pose graph: " + reason);
  }
  std::vector<lc::FragmentPose> poses;
  for (std::size_t k = 0; k < fragments_.size(); ++k) {
    if (!fragments_[k].kept) continue;
    lc::FragmentPose pose;
    pose.id = static_cast<lc::FragmentId>(k);
    pose.world_from_fragment =
        unaligned(map_.keyframes[at(fragments_[k].keyframe)].world_from_camera);
    poses.push_back(pose);
  }
  if (!poses.empty()) closer_.set_poses(poses);
}

bool LoopClosing::process() {
  if (!options_.dense || fragments_.empty()) return false;
  lc::Update update;
  {
    const Stopwatch watch(time_.registration);
    update = closer_.process();
  }
  bool changed = false;
  for (const lc::Loop& loop : update.changed) {
    const int number = number_of(static_cast<int>(loop.source), static_cast<int>(loop.target));
    LoopRecord& record = records_[at(number)];
    const bool was_accepted = record.state == "accepted";
    record.state = lc::to_string(loop.state);
    record.reason = lc::to_string(loop.reason);
    record.confidence = loop.confidence;
    record.drift_ratio = loop.drift_ratio;
    record.target_from_source = Eigen::Isometry3d(loop.target_from_source.matrix());
    const bool accepted = loop.state == lc::LoopState::accepted;
    if (was_accepted) {  // retracted, or accepted with another pose
      map_.remove_loop(number);
      graph_.remove(number);
      record.image_loops = 0;
      changed = true;
    }
    if (!accepted) continue;
    changed = true;
    graph_.add(number, {{record.target_keyframe, record.source_keyframe,
                         Eigen::Isometry3d(loop.target_from_source.matrix()),
                         Eigen::Matrix<double, 6, 6>(kDenseCertainty * loop.information)}});
    connect_image_loops(number, loop, record);
  }
  if (changed) {
    optimize();
    adjust_if_moved();
  }
  limit_fragments();
  return changed;
}

/// Of the two fragments with the most similar views the later one goes, but never the newest.
void LoopClosing::limit_fragments() {
  const std::vector<int> world = graph_.world_of_session(map_);
  while (closer_.size() > options_.max_fragments) {
    double nearest = std::numeric_limits<double>::infinity();
    std::size_t superfluous = 0;  // where every world has one fragment: the oldest
    while (!fragments_[superfluous].kept) ++superfluous;
    for (std::size_t b = 1; b < fragments_.size(); ++b) {
      const Keyframe& kb = map_.keyframes[at(fragments_[b].keyframe)];
      for (std::size_t a = 0; a < b && fragments_[b].kept; ++a) {
        const Keyframe& ka = map_.keyframes[at(fragments_[a].keyframe)];
        if (!fragments_[a].kept || world[at(ka.session)] != world[at(kb.session)]) continue;
        const Eigen::Isometry3d motion = ka.world_from_camera.inverse() * kb.world_from_camera;
        const double distance = motion.translation().norm() +
                                kViewDistance * Eigen::AngleAxisd(motion.linear()).angle();
        if (distance >= nearest) continue;
        nearest = distance;
        superfluous = b + 1 < fragments_.size() ? b : a;
      }
    }
    fragments_[superfluous].kept = false;
    closer_.remove(static_cast<lc::FragmentId>(superfluous));
  }
}

void LoopClosing::adjust_if_moved() {
  if (options_.bundle && moved_since_bundle()) bundle_all(options_.bundle_iterations);
}

bool LoopClosing::moved_since_bundle() const {
  for (std::size_t k = 0; k < adjusted_.size(); ++k) {
    if ((map_.keyframes[k].world_from_camera.translation() - adjusted_[k].translation()).norm() >
        kWorthBundle)
      return true;
  }
  return adjusted_.empty();
}

void LoopClosing::retract(int number) {
  map_.remove_loop(number);
  graph_.remove(number);
  if (number >= kImageLoops) {
    image_records_[at(number - kImageLoops)].retracted = true;
    return;
  }
  LoopRecord& record = records_[at(number)];
  record.state = lc::to_string(lc::LoopState::retracted);
  record.reason = "misfit";
  record.image_loops = 0;
}

bool LoopClosing::conclude(int iterations) {
  const auto misfits = [&] { return graph_.misfits(map_, kMisfitMetres, kMisfitRadians); };
  if (options_.bundle) bundle_all(iterations);
  bool moved = options_.bundle;
  for (std::vector<int> all = misfits(); !all.empty(); all = misfits()) {
    // One at a time: a wrong loop bends the map, and then correct ones do not fit either.
    for (; !all.empty(); all = misfits()) {
      retract(all.front());
      optimize();
    }
    if (options_.bundle) bundle_all(iterations);
    moved = true;
  }
  return moved;
}

void LoopClosing::bundle_all(int iterations) {
  if (map_.keyframes.size() < 2) return;
  const Stopwatch watch(time_.bundle);
  std::vector<int> free, fixed;
  std::vector<bool> anchored;
  const std::vector<int> world = graph_.world_of_session(map_);
  anchored.assign(world.size(), false);
  for (std::size_t k = 0; k < map_.keyframes.size(); ++k) {
    const std::size_t w = at(world[at(map_.keyframes[k].session)]);
    (anchored[w] ? free : fixed).push_back(static_cast<int>(k));
    anchored[w] = true;
  }
  std::vector<RelativePose> relatives = graph_.loop_edges();
  for (const RelativePose& edge : graph_.weak_odometry(map_)) relatives.push_back(edge);
  BundleProblem problem = bundle_of(map_, free, fixed, relatives);
  if (!prior_) prior_ = map_.calibration;
  problem.calibrate = options_.calibrate;
  problem.prior = *prior_;
  adjust(camera_, problem, iterations, options_.threads > 0 ? options_.threads : 2);
  apply(camera_, problem, map_);
  adjusted_.clear();
  for (const Keyframe& keyframe : map_.keyframes) adjusted_.push_back(keyframe.world_from_camera);
}

}  // namespace slam_demo
