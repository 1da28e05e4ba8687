// SPDX-License-Identifier: BSD-3-Clause
#include "pages/map_page.hpp"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <string>
#include <unordered_set>

#include "gpureg/files.hpp"
#include "json/json.hpp"
#include "pages/page.hpp"
#include "records/result_json.hpp"
#include "text.hpp"

namespace gpureg::cli {
namespace {

using reconstruction::Edge;
using reconstruction::Surface;

/// Points of the page, 10 bytes each: 3.3 MB of text.
constexpr std::size_t kPagePoints = 250'000;
/// A scan of a large set still shows its shape.
constexpr std::size_t kLeastScanPoints = 150;

/// Scaling of an island's points to 16 bits.
struct Box {
  Eigen::Vector3f low = Eigen::Vector3f::Constant(std::numeric_limits<float>::infinity());
  Eigen::Vector3f high = -low;
  float size() const { return std::max((high - low).maxCoeff(), 1e-3f); }
};

/// One point per voxel, of voxels large enough for at most so many points.
std::vector<std::size_t> thinned(const Surface& surface, std::size_t most, float& voxel) {
  constexpr float kGrowth = 1.2f;
  constexpr float kCells = 1 << 20;  // along an axis: three coordinates fit a key
  std::vector<std::size_t> kept;
  for (;; voxel *= kGrowth) {
    kept.clear();
    std::unordered_set<std::uint64_t> seen;
    for (std::size_t k = 0; k < surface.points.size() && kept.size() <= most; ++k) {
      const Eigen::Array3f cell = (surface.points[k] / voxel).array().floor();
      if (!(cell.abs() < kCells).all()) continue;
      std::uint64_t key = 0;
      for (int axis = 0; axis < 3; ++axis)
        key = key << 21 | static_cast<std::uint64_t>(static_cast<std::int64_t>(cell[axis]) +
                                                     static_cast<std::int64_t>(kCells));
      if (seen.insert(key).second) kept.push_back(k);
    }
    if (kept.size() <= most) return kept;
  }
}

void append16(std::string& bytes, float share) {
  const auto value = static_cast<std::uint16_t>(std::lround(65535 * std::clamp(share, 0.0f, 1.0f)));
  bytes += static_cast<char>(value & 0xff);
  bytes += static_cast<char>(value >> 8);
}

/// The placed scans' points, moved and quantised, and where each scan's are.
class PagePoints {
 public:
  PagePoints(const MapRun& run, const std::vector<Surface>& surfaces)
      : boxes_(run.made.map.islands.size()) {
    const std::size_t share =
        std::max(kLeastScanPoints, kPagePoints / std::max<std::size_t>(1, run.made.map.placed()));
    std::vector<std::vector<std::size_t>> kept(surfaces.size());
    spacing_.assign(surfaces.size(), run.options.voxel_size / 2);
    for (std::size_t k = 0; k < surfaces.size(); ++k) {
      const reconstruction::Scan& scan = run.made.map.scans[k];
      if (!scan.placed) continue;
      of_map_ += surfaces[k].points.size();
      kept[k] = thinned(surfaces[k], share, spacing_[k]);
      const Eigen::Isometry3f pose(scan.island_from_scan.cast<float>());
      for (const std::size_t point : kept[k]) {
        const Eigen::Vector3f p = pose * surfaces[k].points[point];
        boxes_[scan.island].low = boxes_[scan.island].low.cwiseMin(p);
        boxes_[scan.island].high = boxes_[scan.island].high.cwiseMax(p);
      }
    }
    for (std::size_t k = 0; k < surfaces.size(); ++k) {
      first_.push_back(count_);
      counts_.push_back(kept[k].size());
      count_ += kept[k].size();
      positions_.push_back(append(surfaces[k], kept[k], run.made.map.scans[k]));
    }
  }

  const std::string& bytes() const { return bytes_; }
  std::size_t size() const { return count_; }
  std::size_t of_map() const { return of_map_; }  ///< before they were thinned
  std::size_t first(std::size_t scan) const { return first_[scan]; }
  std::size_t count(std::size_t scan) const { return counts_[scan]; }
  float spacing(std::size_t scan) const { return spacing_[scan]; }
  /// Mean of the sensor positions, or else of the points, in the island's frame.
  const Eigen::Vector3f& position(std::size_t scan) const { return positions_[scan]; }
  const Box& box(std::size_t island) const { return boxes_[island]; }

 private:
  Eigen::Vector3f append(const Surface& surface, const std::vector<std::size_t>& kept,
                         const reconstruction::Scan& scan) {
    Eigen::Vector3f sum = Eigen::Vector3f::Zero();
    if (!scan.placed || kept.empty()) return sum;
    const Box& box = boxes_[scan.island];
    const Eigen::Isometry3f pose(scan.island_from_scan.cast<float>());
    for (const std::size_t k : kept) {
      const Eigen::Vector3f p = pose * surface.points[k],
                            normal = pose.linear() * surface.normals[k];
      for (int axis = 0; axis < 3; ++axis) append16(bytes_, (p[axis] - box.low[axis]) / box.size());
      for (int axis = 0; axis < 3; ++axis)
        bytes_ += static_cast<char>(
            static_cast<std::int8_t>(std::lround(127 * std::clamp(normal[axis], -1.0f, 1.0f))));
      bytes_ += '\0';
      sum += p;
    }
    if (surface.viewpoints.empty()) return sum / static_cast<float>(kept.size());
    sum.setZero();
    for (const Eigen::Vector3f& viewpoint : surface.viewpoints) sum += pose * viewpoint;
    return sum / static_cast<float>(surface.viewpoints.size());
  }

  std::vector<Box> boxes_;
  std::vector<float> spacing_;
  std::vector<std::size_t> first_, counts_;
  std::vector<Eigen::Vector3f> positions_;
  std::size_t count_ = 0, of_map_ = 0;
  std::string bytes_;
};

Json json_of(const Eigen::Vector3f& v) { return {v.x(), v.y(), v.z()}; }

Json scans_json(const MapRun& run, const PagePoints& points) {
  Json out = Json::array();
  for (std::size_t k = 0; k < run.made.map.scans.size(); ++k) {
    const reconstruction::Scan& scan = run.made.map.scans[k];
    const bool plain = scan.reason == reconstruction::ScanReason::none;
    out.push_back({{"name", label(run.scene.scans[k])},
                   {"island", scan.placed ? Json(scan.island) : Json(nullptr)},
                   {"confidence", scan.confidence},
                   {"reason", plain ? "" : reconstruction::describe(scan.reason)},
                   {"position", json_of(points.position(k))},
                   {"first", points.first(k)},
                   {"count", points.count(k)},
                   {"spacing", points.spacing(k)}});
  }
  return out;
}

/// Where a rejected edge would move its source scan, in the island's frame; column by column.
Json moved_json(const MapRun& run, const Edge& edge) {
  const reconstruction::Scan &source = run.made.map.scans[edge.source],
                             &target = run.made.map.scans[edge.target];
  if (edge.accepted || !source.placed || !target.placed || source.island != target.island)
    return nullptr;
  const Eigen::Matrix4d moved =
      (target.island_from_scan * edge.target_from_source * source.island_from_scan.inverse())
          .matrix();
  return to_json(moved.transpose());
}

Json edges_json(const MapRun& run) {
  Json out = Json::array();
  for (const Edge& edge : run.made.map.edges)
    out.push_back({{"i", edge.target},
                   {"j", edge.source},
                   {"confidence", edge.confidence},
                   {"accepted", edge.accepted},
                   {"reason", edge.accepted ? "" : reconstruction::describe(edge.reason)},
                   {"moved", moved_json(run, edge)}});
  return out;
}

std::string scans_text(std::size_t count) {
  return std::to_string(count) + (count == 1 ? " scan" : " scans");
}

std::string sentence_of(const MapRun& run) {
  const std::size_t all = run.made.map.scans.size(), placed = run.made.map.placed(),
                    islands = run.made.map.islands.size();
  if (placed == 0) return "No scan could be placed: no pair is confident enough.";
  std::string text = placed == all ? "All " + scans_text(all) : scans_text(placed);
  text += islands == 1
              ? " are placed in one map"
              : " are placed in " + std::to_string(islands) + " islands, each a map of its own";
  if (placed < all)
    text += "; " + scans_text(all - placed) + (all - placed == 1 ? " is" : " are") + " left out";
  return text + ".";
}

Json figures_json(const MapRun& run, const std::vector<reconstruction::Link>& links,
                  const PagePoints& points) {
  Json weakest = nullptr;
  for (const reconstruction::Link& link : links)
    if (weakest.is_null() || link.confidence < weakest.get<double>()) weakest = link.confidence;
  const std::size_t placed = run.made.map.placed();
  const bool whole = placed == run.made.map.scans.size() && run.made.map.islands.size() == 1;
  return {{"sentence", sentence_of(run)},
          {"grade", placed == 0 ? "bad"
                    : whole     ? "good"
                                : "fair"},
          {"scans", run.made.map.scans.size()},
          {"placed", placed},
          {"islands", run.made.map.islands.size()},
          {"accepted", run.accepted_edges()},
          {"rejected", run.made.map.edges.size() - run.accepted_edges()},
          {"weakest", weakest},
          {"points_shown", points.size()},
          {"points", points.of_map()},
          {"rms", run.made.refinement ? Json(run.made.refinement->final_rmse) : Json(nullptr)}};
}

Json links_json(std::vector<reconstruction::Link> links) {
  constexpr std::size_t kMost = 6;
  std::stable_sort(links.begin(), links.end(),
                   [](const auto& a, const auto& b) { return a.confidence < b.confidence; });
  if (links.size() > kMost) links.resize(kMost);
  Json out = Json::array();
  for (const reconstruction::Link& link : links)
    out.push_back({{"scans", link.scans},
                   {"confidence", link.confidence},
                   {"accepted", link.accepted},
                   {"rejected", link.rejected}});
  return out;
}

}  // namespace

void write_map_page(const MapRun& run) {
  const PagePoints points(run, run.made.surfaces);
  const std::vector<reconstruction::Link> links = reconstruction::weakest_links(run.made.map);
  Json islands = Json::array();
  for (std::size_t k = 0; k < run.made.map.islands.size(); ++k)
    islands.push_back({{"scans", run.made.map.islands[k].scans.size()},
                       {"low", json_of(points.box(k).low)},
                       {"size", points.box(k).size()}});
  const Json data = {{"figures", figures_json(run, links, points)},
                     {"scans", scans_json(run, points)},
                     {"edges", edges_json(run)},
                     {"links", links_json(links)},
                     {"islands", std::move(islands)},
                     {"points", base64(points.bytes())}};
  files::write_atomically(run.file("map.html"),
                          filled(kMapPage, "gpureg map: " + base_name(run.input.path), data));
}

}  // namespace gpureg::cli
