// SPDX-License-Identifier: BSD-3-Clause
#include "localization/plan/plan_search.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "common/for_each_on.hpp"
#include "common/whole.hpp"
#include "localization/plan/upright_scan.hpp"
#include "math/exponential.hpp"
#include "math/trigonometry.hpp"
#include "pipeline/plan_matcher.hpp"

namespace gpureg::localization {
namespace {

/// Scans searched together: their cells take up to 8 MB each.
constexpr std::ptrdiff_t kScansAtOnce = 16;
/// Heights of one place that go on, at least so many cells apart, with this share of the best.
constexpr std::size_t kHeights = 3;
constexpr int kHeightsApart = 5;
constexpr double kShareOfHeight = 0.7;

/// Votes of the next place over those of the best at which it is right as likely as not, and log
/// odds for each unit less (of .5 to .85 where scans are right, .85 to 1 where they are foreign).
constexpr double kUsualRival = 0.88, kLogOddsOfRival = 30;

/// Coarse cells in which the middle of the scan may be: [low, high).
struct Region {
  Eigen::Vector2i low, high;
};

Region region_of(const MapState& map, const FloorPlan& plan, const Scan& scan) {
  Region region{{0, 0}, {plan.coarse_width(), plan.coarse_height()}};
  if (!scan.prior.position) return region;
  const Eigen::Vector3f place =
      plan.turn * (scan.prior.position->position - map.origin).cast<float>();
  const auto radius = static_cast<float>(scan.prior.position->radius + scan.middle.norm());
  for (int axis = 0; axis < 2; ++axis) {
    const int most = region.high[axis];
    const auto cell = [&](float at) {
      return whole((at - plan.corner[axis]) / (2 * plan.cell), 0, most);
    };
    region.low[axis] = cell(place[axis] - radius);
    region.high[axis] = std::min(most, cell(place[axis] + radius) + 1);
  }
  return region;
}

/// Numbers that are few, and looked for often.
class FewNumbers {
 public:
  explicit FewNumbers(std::size_t most) {
    while (table_.size() < 4 * most) table_.assign(2 * table_.size(), kNone);
  }
  bool has(std::uint64_t number) const { return table_[place_of(number)] == number; }
  void add(std::uint64_t number) { table_[place_of(number)] = number; }

 private:
  static constexpr std::uint64_t kNone = ~std::uint64_t{0};
  std::size_t place_of(std::uint64_t number) const {
    std::size_t place = static_cast<std::size_t>(number * 0x9e3779b97f4a7c15u >> 32);
    for (;; ++place) {
      place &= table_.size() - 1;
      if (table_[place] == number || table_[place] == kNone) return place;
    }
  }
  std::vector<std::uint64_t> table_ = std::vector<std::uint64_t>(64, kNone);
};

/// The places that no better one is next to; places: the best first.
std::vector<plan::Place> peaks(const std::vector<plan::Place>& places, int headings,
                               std::size_t most) {
  FewNumbers taken(most);
  const auto key = [&](const plan::Place& place, int dx, int dy, int turn) {
    const auto part = [](int value) { return static_cast<std::uint64_t>(value + 1); };
    return part(place.x + dx) << 42 | part(place.y + dy) << 21 |
           part((place.heading + turn + headings) % headings);
  };
  std::vector<plan::Place> out;
  for (const plan::Place& place : places) {
    if (out.size() == most) break;
    bool is_peak = true;
    for (int k = 0; k < 27 && is_peak; ++k)
      is_peak = !taken.has(key(place, k % 3 - 1, k / 3 % 3 - 1, k / 9 - 1));
    if (!is_peak) continue;
    taken.add(key(place, 0, 0, 0));
    out.push_back(place);
  }
  return out;
}

struct Height {
  int votes = 0;
  float at = 0;  ///< cells over the corner of the plan
};

/// Heights of the middle of the scan at which most points have a surface of the map that faces as
/// they do.
std::vector<Height> heights_of(const FloorPlan& plan, const Upright& scan, bool has_sides,
                               const plan::Place& place) {
  const plan::Heading heading = plan::heading_of(place.heading, 2 * scan.headings);
  std::vector<int> shifts;
  for (const Upright::Point& point : scan.points) {
    const plan::Turned at = plan::turned(point.at, heading);
    const int x = place.x + at.dx, y = place.y + at.dy;
    if (x < 0 || y < 0 || x >= plan.width || y >= plan.height) continue;
    std::uint32_t faces = point.flat != 0 ? point.flat : plan::facing_bits(at.direction, has_sides);
    if (point.flat != 0 && !has_sides) faces = facing::both_sides(faces);
    const std::size_t cell = static_cast<std::size_t>(y) * static_cast<std::size_t>(plan.width) +
                             static_cast<std::size_t>(x);
    int last = std::numeric_limits<int>::min();
    for (std::uint32_t k = plan.column_begin[cell]; k < plan.column_begin[cell + 1]; ++k) {
      if ((plan.columns[k] & faces) == 0) continue;
      const int shift = static_cast<int>(plan.columns[k] >> facing::kBits) - point.height;
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
                            const Scan& scan, const plan::Place& place, float height) {
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

/// A scan with one of its possible verticals.
struct Standing {
  std::size_t scan;
  bool has_sides;
  Upright upright;
  std::vector<plan::Place> places;
  std::vector<std::vector<Height>> heights;  ///< of each place
};

plan::Scan walls_of(const Standing& standing, const Region& region) {
  const Upright& up = standing.upright;
  return {span_of(up.coarse_walls),
          span_of(up.walls),
          up.headings,
          standing.has_sides,
          {region.low[0], region.low[1]},
          {region.high[0], region.high[1]}};
}

/// The scans with each of their possible verticals.
std::vector<Standing> stand_up(const FloorPlan& plan, const std::vector<Scan*>& scans,
                               unsigned threads) {
  const std::size_t count = scans.size();
  struct Shown {
    ScanSurface surface;
    bool has_sides = false;
    std::vector<Eigen::Vector3f> verticals;
  };
  std::vector<Shown> shown(count);
  for_each_on(threads, count, [&](std::size_t k) {
    const Scan& scan = *scans[k];
    for (const Eigen::Vector3d& point : scan.points)
      shown[k].surface.points.push_back((point - scan.middle).cast<float>());
    shown[k].surface.normals = scan.cloud.normals();
    shown[k].has_sides =
        plan.has_sides && scan.cloud.statistics().viewpoint != ViewpointSource::none;
    shown[k].verticals = possible_verticals(shown[k].surface, plan, shown[k].has_sides);
  });
  std::vector<Standing> out;
  std::vector<Eigen::Vector3f> verticals;
  for (std::size_t k = 0; k < count; ++k)
    for (const Eigen::Vector3f& up : shown[k].verticals) {
      out.push_back({k, shown[k].has_sides, {}, {}, {}});
      verticals.push_back(up);
    }
  for_each_on(threads, out.size(), [&](std::size_t s) {
    out[s].upright = stand(shown[out[s].scan].surface, verticals[s], plan.cell);
  });
  return out;
}

/// Candidates of one scan, the most confident first.
std::vector<Candidate> candidates_of(const MapState& map, const FloorPlan& plan, const Scan& scan,
                                     const Standing* begin, const Standing* end, std::size_t most) {
  std::vector<Candidate> out;
  for (const Standing* s = begin; s != end; ++s)
    for (std::size_t k = 0; k < s->places.size(); ++k)
      for (const Height& height : s->heights[k]) {
        Candidate candidate;
        candidate.map_from_scan = pose_of(map, plan, s->upright, scan, s->places[k], height.at);
        candidate.agreeing =
            static_cast<double>(height.votes) / static_cast<double>(s->upright.points.size());
        candidate.confidence = candidate.agreeing;  // distinct() keeps the most; rate() follows
        candidate.mode = out.size();
        if (!contradicts(scan, candidate.map_from_scan)) out.push_back(candidate);
      }
  EvidenceSettings near;  // of two places
  near.mode_distance = 2 * plan.cell;
  out = distinct(std::move(out), scan.middle, near, most + 1);
  rate(out);
  out.resize(std::min(out.size(), most));
  return out;
}

void search_some(const MapState& map, const FloorPlan& plan, PlanMatcher& matcher,
                 const PlanEffort& effort, const std::vector<Scan*>& scans, std::size_t most,
                 unsigned threads) {
  std::vector<Standing> standing = stand_up(plan, scans, threads);
  std::vector<plan::Scan> views;
  for (const Standing& s : standing)
    views.push_back(walls_of(s, region_of(map, plan, *scans[s.scan])));
  std::vector<std::vector<plan::Place>> places = matcher.best_cells(span_of(views), effort.cells);
  for_each_on(threads, standing.size(), [&](std::size_t s) {
    places[s] = peaks(places[s], standing[s].upright.headings, effort.refined);
  });
  places = matcher.refine(span_of(views), places);
  std::vector<std::pair<std::size_t, std::size_t>> of_all;  // standing scans and their places
  for (std::size_t k = 0; k < standing.size(); ++k) {
    Standing& s = standing[k];
    s.places = std::move(places[k]);
    std::stable_sort(s.places.begin(), s.places.end(),
                     [](const auto& a, const auto& b) { return a.score > b.score; });
    s.places.resize(std::min(s.places.size(), effort.with_heights));
    s.heights.resize(s.places.size());
    for (std::size_t place = 0; place < s.places.size(); ++place) of_all.emplace_back(k, place);
  }
  constexpr std::size_t kTogether = 8;
  for_each_on(threads, (of_all.size() + kTogether - 1) / kTogether, [&](std::size_t part) {
    for (std::size_t k = part * kTogether; k < std::min(of_all.size(), (part + 1) * kTogether);
         ++k) {
      Standing& s = standing[of_all[k].first];
      s.heights[of_all[k].second] =
          heights_of(plan, s.upright, s.has_sides, s.places[of_all[k].second]);
    }
  });
  for_each_on(threads, scans.size(), [&](std::size_t k) {
    const auto of_scan = std::equal_range(
        standing.data(), standing.data() + standing.size(), Standing{k, false, {}, {}, {}},
        [](const Standing& a, const Standing& b) { return a.scan < b.scan; });
    scans[k]->planned = candidates_of(map, plan, *scans[k], of_scan.first, of_scan.second, most);
  });
}

}  // namespace

void search_plan(const Context& context, const MapState& map, std::size_t most,
                 const PlanEffort& effort, const std::vector<Scan*>& scans) {
  if (scans.empty()) return;
  const unsigned threads = host_threads(context);
  const FloorPlan& plan = map.plan(threads);
  if (plan.width == 0) return;
  const std::shared_ptr<PlanMatcher> matcher = map.plan_matcher(context);
  for (auto begin = scans.begin(); begin != scans.end();) {
    const auto end = begin + std::min<std::ptrdiff_t>(kScansAtOnce, scans.end() - begin);
    search_some(map, plan, *matcher, effort, {begin, end}, most, threads);
    begin = end;
  }
}

}  // namespace gpureg::localization
