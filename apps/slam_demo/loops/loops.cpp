// SPDX-License-Identifier: BSD-3-Clause
#include "loops/loops.hpp"

#include <algorithm>
#include <limits>

namespace slam_demo {
namespace {

namespace lc = gpureg::loop_closure;

constexpr int kCovisible = 30;          // shared points that connect two fragments
constexpr std::size_t kNeighbours = 6;  // keyframes on each side that look for image loops
constexpr int kLoneInliers = 50;        // that make a loop without registration
// Where images look for loops in their own session: frames ago, metres, cosine between the views.
constexpr int kLoopFrames = 150;
constexpr double kImageMetres = 3, kImageCosine = 0.5;
// Bounds of the drift of tracking: metres, metres of each metre, radians.
constexpr double kDriftMetres = 0.2, kDriftShare = 0.02, kDriftRadians = 0.2;
// Surfaces over many frames hold a registered pair better than LoopCloser states, which speaks of
// single registrations with correlated points: a third of its standard deviation.
constexpr double kDenseCertainty = 9;
constexpr double kViewDistance = 2;  // metres of the surfaces: what a turn moves in a view
constexpr double kBudget = 5;        // milliseconds of a frame, beside the step that goes beyond

}  // namespace

LoopClosing::LoopClosing(const gpureg::Context& context, Map& map, const Pinhole& camera,
                         const LoopOptions& options)
    : map_(map),
      camera_(camera),
      options_(options),
      dense_(context,
             [&] {
               auto o = options.loopsmart
                            ? lc::Options::loopsmart(options.voxel_size)
                            : lc::Options{gpureg::RegistrationOptions{options.voxel_size}};
               if (options.loopsmart)
                 o.registration = gpureg::RegistrationOptions::loopsmart(options.voxel_size);
               o.optimize = false;  // the keyframes are optimised here
               o.registration.seed = options.seed;
               return o;
             }()),
      steps_(options.parallel) {}

void LoopClosing::advance() { steps_.run(kBudget); }

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

void LoopClosing::search_images(int keyframe) {
  // Later keyframes see the same places: none waits for a search that is late.
  if (options_.parallel && searching_) return;
  searching_ = true;
  steps_.then([this, keyframe] {
    std::vector<int> candidates = image_candidates(keyframe);
    searching_ = !candidates.empty();
    if (candidates.empty()) return;
    steps_.beside(
        time_.image,
        [keyframe, candidates, camera = camera_, map = map_.excerpt(candidates)] {
          return image_loop_anywhere(map, camera, keyframe, candidates, kLoneInliers);
        },
        [this, keyframe](const std::optional<ImageLoop>& found) {
          searching_ = false;
          if (found && plausible(found->edge)) connect_images(keyframe, *found);
        });
  });
}

void LoopClosing::connect_images(int keyframe, const ImageLoop& found) {
  const int number = kImageLoops + static_cast<int>(image_records_.size());
  graph_.add(number, {found.edge});
  image_records_.push_back({keyframe, found.edge.a, found.inliers, found.edge.a_from_b, false});
  // Poses first: an observation of a point of another world would not fit.
  optimize();
  steps_.then([this, keyframe, number, found] {
    add_observations(keyframe, found, number);
    adjust_if_moved();
  });
}

void LoopClosing::add_fragment(const BuiltFragment& built,
                               const std::function<gpureg::PointCloud()>& make_cloud) {
  if (!options_.dense) return;
  const int id = static_cast<int>(fragments_.size());
  const Keyframe& keyframe = map_.keyframes[at(built.keyframe)];
  DenseLoops::Fragment fragment;
  fragment.cloud = make_cloud;
  fragment.node.id = id;
  fragment.node.session = keyframe.session;
  fragment.node.time = built.time;
  fragment.node.world_from_fragment = unaligned(keyframe.world_from_camera);
  if (id > 0) {
    const Keyframe& before = map_.keyframes[at(fragments_[at(id - 1)].keyframe)];
    if (before.session == keyframe.session && fragments_[at(id - 1)].keyframe != built.keyframe)
      fragment.odometry.emplace_back(
          id - 1, unaligned(before.world_from_camera.inverse() * keyframe.world_from_camera));
  }
  for (int other = 0; other < id; ++other) {
    if (shares_points(built.keyframe, fragments_[at(other)])) fragment.covisible.push_back(other);
  }
  fragments_.push_back({built.keyframe, built.first_frame, built.last_frame, built.time});
  dense_.add(std::move(fragment));
  steps_.then([this] { register_fragments(); });
}

void LoopClosing::register_fragments() {
  std::vector<DenseLoops::Fragment> fragments = dense_.take_waiting();
  if (fragments.empty()) return;  // an earlier step has taken them
  for (DenseLoops::Fragment& f : fragments) {
    f.covisible.erase(std::remove_if(f.covisible.begin(), f.covisible.end(),
                                     [&](lc::FragmentId id) {
                                       return !fragments_[static_cast<std::size_t>(id)].kept;
                                     }),
                      f.covisible.end());
  }
  steps_.beside(
      time_.registration,
      [this, fragments = std::move(fragments)]() mutable {
        return dense_.process(std::move(fragments));
      },
      [this, count = fragments_.size()](const std::vector<lc::Loop>& changed) {
        registered_ = count;
        take_up(changed);
      });
}

void LoopClosing::take_up(const std::vector<lc::Loop>& changed) {
  connected_ = false;
  for (const lc::Loop& loop : changed) steps_.then([this, loop] { update(loop); });
  steps_.then([this] {
    if (!connected_) return limit_fragments();
    optimize();
    steps_.then([this] { adjust_if_moved(); });
    steps_.then([this] { limit_fragments(); });
  });
}

void LoopClosing::update(const lc::Loop& loop) {
  const int number = number_of(static_cast<int>(loop.source), static_cast<int>(loop.target));
  LoopRecord& record = records_[at(number)];
  if (record.state == "accepted") {  // it is retracted
    map_.remove_loop(number);
    graph_.remove(number);
    record.image_loops = 0;
    connected_ = true;
  }
  record.state = lc::to_string(loop.state);
  record.reason = lc::to_string(loop.reason);
  record.confidence = loop.confidence;
  record.drift_ratio = loop.drift_ratio;
  record.target_from_source = Eigen::Isometry3d(loop.target_from_source.matrix());
  if (loop.state != lc::LoopState::accepted) return;
  connected_ = true;
  const double certainty = options_.loopsmart ? 1 : kDenseCertainty;  // the paper: sums of G'G
  graph_.add(number, {{record.target_keyframe, record.source_keyframe, record.target_from_source,
                       Eigen::Matrix<double, 6, 6>(certainty * loop.information)}});
  connect_image_loops(number, record);
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
void LoopClosing::connect_image_loops(int number, const LoopRecord& record) {
  Eigen::Isometry3d target_from_source = record.target_from_source;
  int moved = record.source_keyframe, still = record.target_keyframe;
  if (map_.keyframes[at(moved)].time < map_.keyframes[at(still)].time) {
    std::swap(moved, still);
    target_from_source = target_from_source.inverse();
  }
  const std::vector<int> targets = with_neighbours(still);
  const Eigen::Isometry3d correction = map_.keyframes[at(still)].world_from_camera *
                                       target_from_source *
                                       map_.keyframes[at(moved)].world_from_camera.inverse();
  std::vector<int> searching = with_neighbours(moved);
  searching.erase(
      std::remove_if(
          searching.begin(), searching.end(),
          [&](int k) { return std::find(targets.begin(), targets.end(), k) != targets.end(); }),
      searching.end());
  using Found = std::vector<std::pair<int, ImageLoop>>;
  steps_.beside(
      time_.image,
      [searching, targets, correction, camera = camera_, map = map_.excerpt(targets)] {
        Found found;
        for (const int k : searching) {
          const auto loop = image_loop_near(
              map, camera, k, correction * map.keyframes[at(k)].world_from_camera, targets);
          if (loop) found.emplace_back(k, *loop);
        }
        return found;
      },
      [this, number](const Found& found) {
        for (const auto& [k, loop] : found) {
          graph_.add(number, {loop.edge});
          add_observations(k, loop, number);
          ++records_[at(number)].image_loops;
        }
      });
}

void LoopClosing::add_observations(int keyframe, const ImageLoop& found, int number) {
  for (const auto& [key, point] : found.matches) {
    if (!map_.points[at(point)].bad) map_.add_observation(point, {keyframe, key, number});
  }
}

/// Of the two fragments with the most similar views the later one goes, but never the newest.
void LoopClosing::limit_fragments() {
  const std::vector<int> world = graph_.world_of_session(map_);
  while (dense_.size() > options_.max_fragments) {
    double nearest = std::numeric_limits<double>::infinity();
    std::size_t superfluous = 0;  // where every world has one fragment: the oldest
    while (!fragments_[superfluous].kept) ++superfluous;
    for (std::size_t b = 1; b < registered_; ++b) {
      const Keyframe& kb = map_.keyframes[at(fragments_[b].keyframe)];
      for (std::size_t a = 0; a < b && fragments_[b].kept; ++a) {
        const Keyframe& ka = map_.keyframes[at(fragments_[a].keyframe)];
        if (!fragments_[a].kept || world[at(ka.session)] != world[at(kb.session)]) continue;
        const Eigen::Isometry3d motion = ka.world_from_camera.inverse() * kb.world_from_camera;
        const double distance = motion.translation().norm() +
                                kViewDistance * Eigen::AngleAxisd(motion.linear()).angle();
        if (distance >= nearest) continue;
        nearest = distance;
        superfluous = b + 1 < registered_ ? b : a;
      }
    }
    fragments_[superfluous].kept = false;
    dense_.remove(static_cast<lc::FragmentId>(superfluous));
  }
}

}  // namespace slam_demo
