// SPDX-License-Identifier: BSD-3-Clause
#include "pages/audit_page.hpp"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <set>
#include <sstream>

#include "pages/page.hpp"
#include "text.hpp"

namespace gpureg::cli {
namespace {

using reconstruction::AuditedPair;
using reconstruction::AuditVerdict;
using reconstruction::ConnectionVerdict;
using reconstruction::PairVerdict;
using Points = std::vector<Eigen::Vector3d>;

constexpr double kWidth = 860, kHeight = 560, kEdge = 20;
constexpr std::size_t kPointsOfMap = 60000, kPointsOfPicture = 2500, kPictures = 8;

Points placed(const std::vector<Eigen::Vector3f>& rows, const PreparedCloud& cloud,
              const UnalignedIsometry3d& pose, std::size_t most) {
  Points out;
  const std::size_t step = std::max<std::size_t>(1, rows.size() / std::max<std::size_t>(1, most));
  for (std::size_t k = 0; k < rows.size(); k += step)
    out.push_back(pose * (cloud.origin() + rows[k].cast<double>()));
  return out;
}

/// Axes of a view from above: the scans of a map lie in a plane, more or less; of two scans, their
/// points.
Eigen::Matrix<double, 2, 3> view_of(const Points& points) {
  Eigen::Vector3d mean = Eigen::Vector3d::Zero();
  for (const Eigen::Vector3d& p : points) mean += p;
  mean /= static_cast<double>(std::max<std::size_t>(1, points.size()));
  Eigen::Matrix3d spread = Eigen::Matrix3d::Identity() * 1e-9;
  for (const Eigen::Vector3d& p : points) spread += (p - mean) * (p - mean).transpose();
  const Eigen::Matrix3d axes =
      Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d>(spread).eigenvectors();
  Eigen::Matrix<double, 2, 3> view;
  view.row(0) = axes.col(2).transpose();
  view.row(1) = axes.col(1).transpose();
  return view;
}

/// An SVG whose scale fits its points.
class Drawing {
 public:
  Drawing(const Points& points, double width, double height)
      : view_(view_of(points)), width_(width), height_(height) {
    Eigen::Vector2d high = Eigen::Vector2d::Constant(-std::numeric_limits<double>::infinity());
    low_ = -high;
    for (const Eigen::Vector3d& p : points) {
      low_ = low_.cwiseMin(view_ * p);
      high = high.cwiseMax(view_ * p);
    }
    const Eigen::Vector2d size = (high - low_).cwiseMax(1e-6);
    scale_ = std::min((width - 2 * kEdge) / size.x(), (height - 2 * kEdge) / size.y());
    out_ << "<svg viewBox='0 0 " << width << " " << height << "' width='" << width << "'>";
  }

  /// All in one path: a page with 60,000 elements is slow.
  void dots(const Points& points, const char* color, double size) {
    out_ << "<path stroke='" << color << "' stroke-width='" << size
         << "' stroke-linecap='round' fill='none' d='";
    for (const Eigen::Vector3d& p : points) out_ << "M" << at(p) << "h0";
    out_ << "'/>";
  }
  void line(const Eigen::Vector3d& a, const Eigen::Vector3d& b, const char* color, double size) {
    out_ << "<path stroke='" << color << "' stroke-width='" << size << "' fill='none' d='M" << at(a)
         << "L" << at(b) << "'/>";
  }
  void label(const Eigen::Vector3d& p, const std::string& text) {
    const Eigen::Vector2d q = place(p);
    out_ << "<text x='" << fixed(q.x() + 5, 1) << "' y='" << fixed(q.y() - 5, 1) << "'>" << text
         << "</text>";
  }
  std::string text() const { return out_.str() + "</svg>"; }

 private:
  Eigen::Vector2d place(const Eigen::Vector3d& p) const {
    const Eigen::Vector2d q = scale_ * (view_ * p - low_);
    return {kEdge + q.x(), height_ - kEdge - q.y()};
  }
  std::string at(const Eigen::Vector3d& p) const {
    const Eigen::Vector2d q = place(p);
    return fixed(q.x(), 1) + " " + fixed(q.y(), 1);
  }

  Eigen::Matrix<double, 2, 3> view_;
  Eigen::Vector2d low_;
  double width_, height_, scale_ = 1;
  std::ostringstream out_;
};

/// Points that stand nearer to a sensor than what it saw in their direction.
Points in_front(const Points& points, const Points& seen, const Points& sensors, double margin) {
  constexpr int kRows = 60, kColumns = 120;  // three degrees
  const auto cell = [](const Eigen::Vector3d& d, double range) {
    const double up = std::acos(std::clamp(d.z() / range, -1.0, 1.0)) / M_PI;
    const double round = (std::atan2(d.y(), d.x()) + M_PI) / (2 * M_PI);
    return static_cast<std::size_t>(std::min(kRows - 1, static_cast<int>(up * kRows)) * kColumns +
                                    std::min(kColumns - 1, static_cast<int>(round * kColumns)));
  };
  std::vector<char> front(points.size(), 0);
  const std::size_t step = std::max<std::size_t>(1, sensors.size() / 8);
  for (std::size_t s = 0; s < sensors.size(); s += step) {
    // The nearest surface of a cell: behind it may be anything.
    std::vector<double> depth(kRows * kColumns, -1);
    for (const Eigen::Vector3d& p : seen) {
      const double range = (p - sensors[s]).norm();
      if (range <= 0) continue;
      double& nearest = depth[cell(p - sensors[s], range)];
      nearest = nearest < 0 ? range : std::min(nearest, range);
    }
    for (std::size_t k = 0; k < points.size(); ++k) {
      const double range = (points[k] - sensors[s]).norm();
      if (range > 0 && depth[cell(points[k] - sensors[s], range)] > range + margin) front[k] = 1;
    }
  }
  Points out;
  for (std::size_t k = 0; k < points.size(); ++k)
    if (front[k]) out.push_back(points[k]);
  return out;
}

bool is_of(std::uint32_t scan, const reconstruction::Island& island) {
  return std::binary_search(island.scans.begin(), island.scans.end(), scan);
}

std::string map_picture(const AuditRun& run, const reconstruction::Island& island) {
  const std::vector<PreparedCloud>& clouds = run.scene.clouds;
  Points all, centres(clouds.size(), Eigen::Vector3d::Zero());
  for (const std::uint32_t k : island.scans) {
    const UnalignedIsometry3d& pose = run.map.scans[k].island_from_scan;
    const Points points = placed(clouds[k].points(), clouds[k], pose, kPointsOfMap / clouds.size());
    const Points sensors = placed(clouds[k].viewpoints(), clouds[k], pose, 50);
    all.insert(all.end(), points.begin(), points.end());
    for (const Eigen::Vector3d& sensor : sensors)
      centres[k] += sensor / static_cast<double>(sensors.size());
  }
  Drawing drawing(all, kWidth, kHeight);
  drawing.dots(all, "#c9cbd0", 1.2);
  for (const PairVerdict verdict : {PairVerdict::supports, PairVerdict::contradicts})
    for (const AuditedPair& pair : run.audit.pairs)
      if (pair.verdict == verdict && is_of(pair.source, island))
        drawing.line(centres[pair.source], centres[pair.target],
                     verdict == PairVerdict::supports ? "#2f9e5b66" : "#d6453d",
                     verdict == PairVerdict::supports ? 0.8 : 1.6);
  std::set<std::uint32_t> broken;
  for (const auto& connection : run.audit.connections) {
    if (connection.verdict != ConnectionVerdict::contradicted) continue;
    const std::vector<std::uint32_t> scans = run.audit.scans_of(connection);
    broken.insert(scans.begin(), scans.end());
  }
  for (const std::uint32_t k : island.scans) {
    drawing.dots({centres[k]}, broken.count(k) ? "#d6453d" : "#22221f", 6);
    drawing.label(centres[k], escaped(label(run.scene.scans[k])));
  }
  return drawing.text();
}

std::string pair_picture(const AuditRun& run, const AuditedPair& pair) {
  const auto points_of = [&](std::uint32_t k) {
    return placed(run.scene.clouds[k].points(), run.scene.clouds[k],
                  run.map.scans[k].island_from_scan, kPointsOfPicture);
  };
  const auto sensors_of = [&](std::uint32_t k) {
    return placed(run.scene.clouds[k].viewpoints(), run.scene.clouds[k],
                  run.map.scans[k].island_from_scan, 50);
  };
  const double margin = 6 * static_cast<double>(run.options.voxel_size);
  const Points a = points_of(pair.target), b = points_of(pair.source);
  Points all = a;
  all.insert(all.end(), b.begin(), b.end());
  Drawing drawing(all, kWidth / 2, kHeight / 2);
  drawing.dots(a, "#7aa6d8", 1.6);
  drawing.dots(b, "#9a9a92", 1.6);
  drawing.dots(in_front(b, a, sensors_of(pair.target), margin), "#d6453d", 2.2);
  drawing.dots(in_front(a, b, sensors_of(pair.source), margin), "#d6453d", 2.2);
  return drawing.text();
}

const char* class_of(AuditVerdict verdict) {
  return verdict == AuditVerdict::sound          ? "good"
         : verdict == AuditVerdict::contradicted ? "bad"
                                                 : "open";
}

const char* title_of(AuditVerdict verdict) {
  return verdict == AuditVerdict::sound          ? "Sound"
         : verdict == AuditVerdict::contradicted ? "Contradicted"
                                                 : "Undecided";
}

}  // namespace

std::string audit_page(const AuditRun& run) {
  const AuditVerdict verdict = run.audit.verdict();
  std::ostringstream out;
  out << "<!DOCTYPE html>\n<html lang='en'><head><meta charset='utf-8'><title>Audit of "
      << escaped(run.poses_file) << "</title><style>body{font:15px/1.5 system-ui,sans-serif;"
      << "margin:24px auto;max-width:900px;color:#22221f}h1{font-size:23px}svg{background:#fff;"
      << "border:1px solid #e2e2dc;max-width:100%}svg text{font-size:10px}.bad{color:#d6453d}"
      << ".good{color:#2f9e5b}figure{display:inline-block;width:430px;margin:8px 6px}</style>"
      << "</head><body><h1 class='" << class_of(verdict) << "'>" << title_of(verdict) << "</h1><p>"
      << escaped(run.poses_file) << ", scans of " << escaped(run.input.path) << "</p>";
  std::vector<std::size_t> worst;
  for (const auto& connection : run.audit.connections) {
    if (connection.verdict != ConnectionVerdict::contradicted) continue;
    out << "<p class='bad'>Broken at " << escaped(describe(run, connection)) << ".</p>";
    for (const std::size_t k : connection.contradictions)
      if (std::find(worst.begin(), worst.end(), k) == worst.end()) worst.push_back(k);
  }
  if (verdict == AuditVerdict::undecided)
    out << "<p>Nothing is contradicted, but most scans do not see each other. Are these poses of "
           "these scans, in the unit of their points?</p>";
  out << "<p>From above: scans that agree are joined in green, scans that contradict each other in "
         "red; red dots are the scans that do not fit the rest.</p>";
  const std::vector<AuditVerdict> verdicts = run.audit.verdicts();
  for (std::size_t k = 0; k < verdicts.size(); ++k) {
    if (run.audit.islands[k].scans.empty()) continue;
    if (verdicts.size() > 1)
      out << "<h2 class='" << class_of(verdicts[k]) << "'>Island " << k << ", "
          << escaped(island_scans(run, k)) << ": " << to_string(verdicts[k]) << "</h2>";
    out << map_picture(run, run.audit.islands[k]);
  }
  std::stable_sort(worst.begin(), worst.end(), [&](std::size_t a, std::size_t b) {
    return run.audit.pairs[a].violation > run.audit.pairs[b].violation;
  });
  if (!worst.empty())
    out << "<h2>Why</h2><p>Two scans each, one blue and one grey. Red: points of one where the "
           "other looked through.</p>";
  for (std::size_t k = 0; k < std::min(kPictures, worst.size()); ++k) {
    const AuditedPair& pair = run.audit.pairs[worst[k]];
    out << "<figure>" << pair_picture(run, pair) << "<figcaption>"
        << escaped(label(run.scene.scans[pair.target])) << " and "
        << escaped(label(run.scene.scans[pair.source])) << ": " << fixed(100 * pair.violation, 0)
        << " % in free space, overlap " << fixed(100 * pair.overlap, 0)
        << " %</figcaption></figure>";
  }
  out << "</body></html>\n";
  return out.str();
}

}  // namespace gpureg::cli
