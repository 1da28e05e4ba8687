// SPDX-License-Identifier: BSD-3-Clause
#include "localization/plan_search.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <unordered_set>

#include "common/for_each_on.hpp"
#include "common/stop_scope.hpp"
#include "math/atan2.hpp"
#include "math/exponential.hpp"
#include "math/trigonometry.hpp"

namespace gpureg::localization {
namespace {

/// Directions of a scan that are tried as the vertical.
constexpr std::size_t kAxes = 3;
/// Walls of a scan in coarse cells (a score is a byte), in cells, and points for the height.
constexpr std::size_t kCoarseWalls = 255, kWalls = 512, kPoints = 512;
/// Places of a heading that go on from coarse cells.
constexpr std::size_t kOfHeading = 256;
/// Of these, so many are refined at once, until no coarse score is above those of so many refined
/// places, or with the work of so many walls; so many of an axis then get heights.
constexpr std::size_t kAtOnce = 128, kRefined = 8, kWallsRefined = 150'000, kOfAxis = 128;
/// Cells scored at once: they stay in the cache.
constexpr int kCellsAtOnce = 1 << 14;
/// Half the width of the search around a coarse place, in cells and in steps of the heading.
constexpr int kAroundPlace = 3, kTurnsAround = 2;
/// Heights of one place that go on, at least so many cells apart, with this share of the best.
constexpr std::size_t kHeights = 3;
constexpr int kHeightsApart = 5;
constexpr double kShareOfHeight = 0.7;

/// Votes of the next place over those of the best at which it is right as likely as not, and log
/// odds for each unit less (of .5 to .85 where scans are right, .85 to 1 where they are foreign).
constexpr double kUsualRival = 0.88, kLogOddsOfRival = 30;

struct Wall {
  float x, y;
  float direction;  ///< of facing::kDirections
};

/// A scan with one of its directions upright, relative to its middle.
struct Upright {
  Eigen::Matrix3f turn = Eigen::Matrix3f::Identity();
  std::vector<Wall> walls, coarse_walls;
  struct Point {
    Eigen::Vector3f at, normal;
  };
  std::vector<Point> points;
  int headings = 0;  ///< steps of a coarse turn
};

/// A place of the middle of the scan, in cells, and a heading in steps.
struct Place {
  int score = 0, x = 0, y = 0, heading = 0;
};

template <typename T>
std::vector<T> some_of(const std::vector<T>& all, std::size_t most) {
  if (all.size() <= most) return all;
  std::vector<T> out;
  for (std::size_t k = 0; k < most; ++k) out.push_back(all[k * all.size() / most]);
  return out;
}

/// A cell and what faces it, as one number; a scan reaches less than 2^14 cells, but for heights.
std::uint64_t key_of(int x, int y, int z, std::uint32_t faces) {
  const auto part = [](int value, int bits) {
    return static_cast<std::uint64_t>(value) & ((std::uint64_t{1} << bits) - 1);
  };
  return part(x, 16) << 48 | part(y, 16) << 32 | part(z, 14) << 18 | faces;
}

/// One wall per cell and direction.
std::vector<Wall> walls_in_cells(const std::vector<Wall>& walls, float cell, std::size_t most) {
  std::unordered_set<std::uint64_t> seen;
  std::vector<Wall> out;
  for (const Wall& wall : walls)
    if (seen.insert(key_of(static_cast<int>(std::floor(wall.x / cell)),
                           static_cast<int>(std::floor(wall.y / cell)),
                           static_cast<int>(std::lround(wall.direction)), 0))
            .second)
      out.push_back(wall);
  return some_of(out, most);
}

struct ScanPoints {
  std::vector<Eigen::Vector3f> points, normals;  ///< relative to the middle
};

/// Floors of the map may be what faces the axis or what faces the opposite.
bool faces_both(const Axis& axis) { return 4 * axis.opposite >= axis.facing; }

/// The most frequent normals, and what is perpendicular to the first two: of a scan that sees walls
/// alone.
std::vector<Axis> possible_verticals(const std::vector<Eigen::Vector3f>& normals) {
  std::vector<Axis> axes = frequent_axes(normals, kAxes);
  if (axes.size() < 2) return axes;
  Axis third;
  third.direction = axes[0].direction.cross(axes[1].direction).normalized();
  const auto is_known = [&](const Axis& axis) {
    return std::abs(axis.direction.dot(third.direction)) > kSameAxis;
  };
  if (std::none_of(axes.begin(), axes.end(), is_known)) axes.push_back(third);
  return axes;
}

Upright stand(const ScanPoints& scan, const Eigen::Vector3f& up, float cell) {
  Upright out;
  out.turn = upright(up);
  const float reach = FloorPlan::kReach / FloorPlan::kCell * cell;
  constexpr float kPerRadian = facing::kDirections / (2 * kPi);
  std::vector<Wall> walls;
  std::vector<Upright::Point> points;
  std::unordered_set<std::uint64_t> seen;
  float farthest = 0;
  for (std::size_t k = 0; k < scan.points.size(); ++k) {
    const Eigen::Vector3f normal = out.turn * scan.normals[k];
    const std::uint32_t faces = facing::of(normal, true);
    const Eigen::Vector3f at = out.turn * scan.points[k];
    const float distance = at.head<2>().norm();
    if (faces == 0 || distance > reach) continue;
    const Eigen::Vector3i in = (at / cell).array().floor().cast<int>();
    if (seen.insert(key_of(in[0], in[1], in[2], faces)).second) points.push_back({at, normal});
    if ((faces & facing::kWalls) == 0) continue;
    farthest = std::max(farthest, distance);
    walls.push_back({at[0], at[1], exact_atan2(normal[1], normal[0]) * kPerRadian});
  }
  out.walls = walls_in_cells(walls, cell, kWalls);
  out.coarse_walls = walls_in_cells(walls, 2 * cell, kCoarseWalls);
  out.points = some_of(points, kPoints);
  // A step moves the farthest wall by 1.4 coarse cells.
  out.headings = std::max(16, static_cast<int>(std::ceil(2 * kPi * 0.7f * farthest / (2 * cell))));
  return out;
}

struct Heading {
  float cos, sin, turn;  ///< turn: in facing::kDirections
};

Heading heading_of(int step, int steps) {
  const double angle = 2 * portable::kPi * step / steps;
  return {static_cast<float>(portable::cos(angle)), static_cast<float>(portable::sin(angle)),
          static_cast<float>(step) * facing::kDirections / static_cast<float>(steps)};
}

struct Turned {
  int dx, dy, direction;
};

Turned turned(const Wall& wall, const Heading& heading, float cell) {
  constexpr int kAll = facing::kDirections;
  const int direction = static_cast<int>(std::lround(wall.direction + heading.turn));
  return {static_cast<int>(std::lround((heading.cos * wall.x - heading.sin * wall.y) / cell)),
          static_cast<int>(std::lround((heading.sin * wall.x + heading.cos * wall.y) / cell)),
          (direction % kAll + kAll) % kAll};
}

/// Cells in which the middle of the scan may be: [low, high).
struct Region {
  Eigen::Vector2i low, high;
};

Region region_of(const MapState& map, const FloorPlan& plan, const Scan& scan) {
  Region region{{0, 0}, {plan.width, plan.height}};
  if (!scan.prior.position) return region;
  const Eigen::Vector3f place =
      plan.turn * (scan.prior.position->position - map.origin).cast<float>();
  const auto radius = static_cast<float>(scan.prior.position->radius + scan.middle.norm());
  for (int axis = 0; axis < 2; ++axis) {
    const int most = region.high[axis];
    const auto cell = [&](float at) {
      return static_cast<int>(
          std::clamp((at - plan.corner[axis]) / plan.cell, 0.0f, static_cast<float>(most)));
    };
    region.low[axis] = cell(place[axis] - radius);
    region.high[axis] = std::min(most, cell(place[axis] + radius) + 1);
  }
  return region;
}

/// Wider registers where there are some: sums of bytes have the same bits in any.
#if defined(__x86_64__) && defined(__GNUC__) && !defined(__SANITIZE_THREAD__) && \
    !defined(__SANITIZE_ADDRESS__)
__attribute__((target_clones("avx2", "default")))
#endif
void add_rows(std::uint8_t* to, const std::array<const std::uint8_t*, 4>& rows, int count) {
  const std::uint8_t *a = rows[0], *b = rows[1], *c = rows[2], *d = rows[3];
  for (int k = 0; k < count; ++k)
    to[k] = static_cast<std::uint8_t>(to[k] + a[k] + b[k] + c[k] + d[k]);
}

/// The best coarse cells of one heading.
std::vector<Place> score_heading(const FloorPlan& plan, const Upright& scan, bool has_sides,
                                 const Region& region, int heading) {
  const int left = region.low[0] / 2, right = (region.high[0] + 1) / 2;
  const int top = region.low[1] / 2, bottom = (region.high[1] + 1) / 2;
  const Heading turn = heading_of(heading, scan.headings);
  std::vector<const std::uint8_t*> walls;  // where the wall is for cell (0, 0)
  for (const Wall& wall : scan.coarse_walls) {
    const Turned at = turned(wall, turn, 2 * plan.cell);
    const int plane =
        has_sides ? at.direction : facing::kDirections + at.direction % (facing::kDirections / 2);
    walls.push_back(plan.plane(plane) + at.dy * plan.stride() + at.dx);
  }
  std::vector<Place> best;
  const int columns = right - left, rows_at_once = std::max(1, kCellsAtOnce / std::max(1, columns));
  std::array<std::size_t, 256> counts{};
  std::vector<std::uint8_t> all(static_cast<std::size_t>(columns) *
                                static_cast<std::size_t>(bottom - top));
  const std::vector<std::uint8_t> nothing(static_cast<std::size_t>(columns), 0);
  for (int block = top; block < bottom; block += rows_at_once)
    for (std::size_t k = 0; k < walls.size(); k += 4)
      for (int y = block; y < std::min(bottom, block + rows_at_once); ++y) {
        std::array<const std::uint8_t*, 4> rows;
        for (std::size_t i = 0; i < 4; ++i)
          rows[i] = k + i < walls.size() ? walls[k + i] + y * plan.stride() + left : nothing.data();
        add_rows(all.data() + static_cast<std::ptrdiff_t>(y - top) * columns, rows, columns);
      }
  for (const std::uint8_t score : all) ++counts[score];
  int least = 255;
  for (std::size_t above = counts[255]; least > 1 && above < kOfHeading;)
    above += counts[static_cast<std::size_t>(--least)];
  for (std::size_t k = 0; k < all.size(); ++k)
    if (all[k] >= least)
      best.push_back({all[k], static_cast<int>(k % static_cast<std::size_t>(columns)) + left,
                      static_cast<int>(k / static_cast<std::size_t>(columns)) + top, heading});
  std::stable_sort(best.begin(), best.end(),
                   [](const Place& a, const Place& b) { return a.score > b.score; });
  best.resize(std::min(best.size(), kOfHeading));
  return best;
}

/// The places that no better one is next to, the best first.
std::vector<Place> peaks(std::vector<Place> places, int headings, std::size_t most) {
  std::stable_sort(places.begin(), places.end(),
                   [](const Place& a, const Place& b) { return a.score > b.score; });
  std::unordered_set<std::uint64_t> taken;
  const auto key = [&](const Place& place, int dx, int dy, int turn) {
    const auto part = [](int value) { return static_cast<std::uint64_t>(value + 1); };
    return part(place.x + dx) << 42 | part(place.y + dy) << 21 |
           part((place.heading + turn + headings) % headings);
  };
  std::vector<Place> out;
  for (const Place& place : places) {
    if (out.size() == most) break;
    bool is_peak = true;
    for (int k = 0; k < 27 && is_peak; ++k)
      is_peak = taken.count(key(place, k % 3 - 1, k / 3 % 3 - 1, k / 9 - 1)) == 0;
    if (!is_peak) continue;
    taken.insert(key(place, 0, 0, 0));
    out.push_back(place);
  }
  return out;
}

/// The best cell and heading, in half the step, around a coarse place.
Place refine(const FloorPlan& plan, const Upright& scan, bool has_sides, const Place& coarse) {
  constexpr int kEdge = 2 * kAroundPlace + 1;
  Place best;
  best.score = -1;
  for (int turn = -kTurnsAround; turn <= kTurnsAround; ++turn) {
    const int heading = 2 * coarse.heading + turn;
    const Heading at = heading_of(heading, 2 * scan.headings);
    std::array<int, kEdge * kEdge> scores{};
    for (const Wall& wall : scan.walls) {
      const Turned cell = turned(wall, at, plan.cell);
      std::uint32_t bits = 1u << cell.direction;
      if (!has_sides) bits = facing::both_sides(bits);
      const int x = 2 * coarse.x + cell.dx - kAroundPlace,
                y = 2 * coarse.y + cell.dy - kAroundPlace;
      for (int v = 0; v < kEdge; ++v) {
        if (y + v < 0 || y + v >= plan.height) continue;
        const std::uint16_t* row =
            plan.walls.data() + static_cast<std::ptrdiff_t>(y + v) * plan.width;
        for (int u = 0; u < kEdge; ++u)
          if (x + u >= 0 && x + u < plan.width)
            scores[static_cast<std::size_t>(v * kEdge + u)] += (row[x + u] & bits) != 0;
      }
    }
    for (int v = 0; v < kEdge; ++v)
      for (int u = 0; u < kEdge; ++u) {
        const int score = scores[static_cast<std::size_t>(v * kEdge + u)];
        if (score > best.score)
          best = {score, 2 * coarse.x + u - kAroundPlace, 2 * coarse.y + v - kAroundPlace, heading};
      }
  }
  return best;
}

/// Refines coarse places in the order of their scores, which the refined ones hardly surpass, until
/// enough refined ones are better than what is left.
std::vector<Place> refine_best(const FloorPlan& plan, const Upright& scan, bool has_sides,
                               std::vector<Place> coarse, unsigned threads) {
  std::vector<Place> out;
  if (scan.walls.empty()) return out;
  coarse =
      peaks(std::move(coarse), scan.headings, std::max(kAtOnce, kWallsRefined / scan.walls.size()));
  const auto order = [](const Place& a, const Place& b) { return a.score > b.score; };
  while (out.size() < coarse.size()) {
    const std::size_t begin = out.size(), end = std::min(coarse.size(), begin + kAtOnce);
    out.resize(end);
    for_each_on(
        threads, end - begin, [] { return 0; },
        [&](std::size_t k, int) {
          out[begin + k] = refine(plan, scan, has_sides, coarse[begin + k]);
        });
    if (end == coarse.size() || end < kRefined) break;
    std::vector<Place> sorted = out;
    std::nth_element(sorted.begin(), sorted.begin() + kRefined - 1, sorted.end(), order);
    // Shares of walls: coarse ones are fewer.
    if (static_cast<double>(sorted[kRefined - 1].score) *
            static_cast<double>(scan.coarse_walls.size()) >=
        static_cast<double>(coarse[end].score) * static_cast<double>(scan.walls.size()))
      break;
  }
  std::stable_sort(out.begin(), out.end(), order);
  out.resize(std::min(out.size(), kOfAxis));
  return out;
}

struct Height {
  int votes = 0;
  float at = 0;  ///< cells over the corner of the plan
};

/// Heights of the middle of the scan at which most points have a surface of the map that faces as
/// they do.
std::vector<Height> heights_of(const FloorPlan& plan, const Upright& scan, bool has_sides,
                               const Place& place) {
  const Heading heading = heading_of(place.heading, 2 * scan.headings);
  std::vector<int> shifts;
  Eigen::Matrix3f turn = Eigen::Matrix3f::Identity();
  turn.topLeftCorner<2, 2>() << heading.cos, -heading.sin, heading.sin, heading.cos;
  for (const Upright::Point& point : scan.points) {
    const Eigen::Vector3f at = turn * point.at / plan.cell;
    const int x = place.x + static_cast<int>(std::lround(at[0])),
              y = place.y + static_cast<int>(std::lround(at[1]));
    if (x < 0 || y < 0 || x >= plan.width || y >= plan.height) continue;
    std::uint32_t faces = facing::of(turn * point.normal, true);
    if (!has_sides) faces = facing::both_sides(faces);
    const std::size_t cell = static_cast<std::size_t>(y) * static_cast<std::size_t>(plan.width) +
                             static_cast<std::size_t>(x);
    int last = std::numeric_limits<int>::min();
    for (std::uint32_t k = plan.column_begin[cell]; k < plan.column_begin[cell + 1]; ++k) {
      if ((plan.columns[k] & faces) == 0) continue;
      const int shift =
          static_cast<int>(plan.columns[k] >> facing::kBits) - static_cast<int>(std::floor(at[2]));
      // One point votes once for a height and the one below it.
      for (const int vote : {shift - 1, shift})
        if (vote > last) shifts.push_back(last = vote);
    }
  }
  std::vector<Height> out;
  if (shifts.empty()) return out;
  const auto [low, high] = std::minmax_element(shifts.begin(), shifts.end());
  std::vector<int> votes(static_cast<std::size_t>(*high - *low) + 1, 0);
  const int lowest = *low;
  for (const int shift : shifts) ++votes[static_cast<std::size_t>(shift - lowest)];
  while (out.size() < kHeights) {
    const auto best = std::max_element(votes.begin(), votes.end());
    if (*best == 0 || (!out.empty() && *best < kShareOfHeight * out.front().votes)) break;
    const int shift = static_cast<int>(best - votes.begin());
    out.push_back({*best, static_cast<float>(lowest + shift) + 1});
    for (int k = std::max(0, shift - kHeightsApart);
         k <= std::min(shift + kHeightsApart, static_cast<int>(votes.size()) - 1); ++k)
      votes[static_cast<std::size_t>(k)] = 0;
  }
  return out;
}

UnalignedIsometry3d pose_of(const MapState& map, const FloorPlan& plan, const Upright& up,
                            const Scan& scan, const Place& place, float height) {
  const double angle = portable::kPi * place.heading / up.headings;
  Eigen::Matrix3d heading = Eigen::Matrix3d::Identity();
  heading.topLeftCorner<2, 2>() << portable::cos(angle), -portable::sin(angle),
      portable::sin(angle), portable::cos(angle);
  const Eigen::Vector3d cell(place.x + 0.5, place.y + 0.5, static_cast<double>(height));
  const Eigen::Vector3d middle = plan.corner.cast<double>() + cell * static_cast<double>(plan.cell);
  const Eigen::Matrix3d back = plan.turn.cast<double>().transpose();
  UnalignedIsometry3d pose = UnalignedIsometry3d::Identity();
  pose.linear() = back * heading * up.turn.cast<double>();
  pose.translation() = back * middle + map.origin - pose.linear() * scan.middle;
  return pose;
}

/// Turns votes, the most first, into confidences: of all places of a map, the right one has many
/// more votes than any other, and what others have in a map without the right one is about equal.
void rate(std::vector<Candidate>& places) {
  if (places.empty()) return;
  const double first = places.front().agreeing;
  const double second = places.size() > 1 ? places[1].agreeing : 0;
  for (std::size_t k = 0; k < places.size(); ++k) {
    const double rival = (k == 0 ? second : first) / places[k].agreeing;
    const double odds = portable::exp(kLogOddsOfRival * (kUsualRival - rival));
    places[k].confidence = odds / (1 + odds);
  }
}

}  // namespace

std::vector<Candidate> search_plan(const MapState& map, const FloorPlan& plan, const Scan& scan,
                                   std::size_t most, unsigned threads) {
  if (plan.width == 0 || scan.points.empty()) return {};
  ScanPoints centred;
  for (const Eigen::Vector3d& point : scan.points)
    centred.points.push_back((point - scan.middle).cast<float>());
  centred.normals = scan.cloud.normals();
  const bool scan_has_sides = scan.cloud.statistics().viewpoint != ViewpointSource::none;
  const bool has_sides = scan_has_sides && plan.has_sides;
  const Region region = region_of(map, plan, scan);
  if ((region.high - region.low).minCoeff() <= 0) return {};

  std::vector<Eigen::Vector3f> verticals;
  for (const Axis& axis : possible_verticals(centred.normals)) {
    verticals.push_back(axis.direction);
    if (plan.has_ceiling || !has_sides || faces_both(axis)) verticals.push_back(-axis.direction);
  }
  std::vector<Upright> uprights(verticals.size());
  for_each_on(
      threads, verticals.size(), [] { return 0; },
      [&](std::size_t u, int) { uprights[u] = stand(centred, verticals[u], plan.cell); });
  struct Task {
    std::size_t upright;
    int heading;
  };
  std::vector<Task> tasks;
  for (std::size_t u = 0; u < uprights.size(); ++u)
    for (int heading = 0; heading < uprights[u].headings; ++heading) tasks.push_back({u, heading});
  std::vector<std::vector<Place>> found(tasks.size());
  const auto nothing = [] { return 0; };
  for_each_on(threads, tasks.size(), nothing, [&](std::size_t k, int) {
    StopScope::poll();
    found[k] = score_heading(plan, uprights[tasks[k].upright], has_sides, region, tasks[k].heading);
  });
  std::vector<std::vector<Place>> coarse(uprights.size());
  for (std::size_t k = 0; k < tasks.size(); ++k)
    coarse[tasks[k].upright].insert(coarse[tasks[k].upright].end(), found[k].begin(),
                                    found[k].end());
  struct Fine {
    std::size_t upright;
    Place place;
    std::vector<Height> heights;
  };
  std::vector<Fine> fine;
  for (std::size_t u = 0; u < uprights.size(); ++u)
    for (const Place& place :
         refine_best(plan, uprights[u], has_sides, std::move(coarse[u]), threads))
      fine.push_back({u, place, {}});
  for_each_on(threads, fine.size(), nothing, [&](std::size_t k, int) {
    fine[k].heights = heights_of(plan, uprights[fine[k].upright], has_sides, fine[k].place);
  });
  std::vector<Candidate> out;
  for (std::size_t k = 0; k < fine.size(); ++k)
    for (const Height& height : fine[k].heights) {
      const Upright& up = uprights[fine[k].upright];
      Candidate candidate;
      candidate.map_from_scan = pose_of(map, plan, up, scan, fine[k].place, height.at);
      candidate.agreeing =
          static_cast<double>(height.votes) / static_cast<double>(up.points.size());
      candidate.confidence = candidate.agreeing;  // distinct() keeps the most; rate() follows
      candidate.mode = out.size();
      if (!contradicts(scan, candidate.map_from_scan)) out.push_back(candidate);
    }
  EvidenceOptions near;  // of two places
  near.mode_distance = 2 * plan.cell;
  out = distinct(std::move(out), scan.middle, near, most + 1);
  rate(out);
  out.resize(std::min(out.size(), most));
  return out;
}

}  // namespace gpureg::localization
