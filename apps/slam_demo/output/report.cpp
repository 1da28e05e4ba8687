// SPDX-License-Identifier: BSD-3-Clause
#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>

#include "output/output.hpp"

/// report.html: one file, nothing loaded from elsewhere. C++ gives the numbers, the page draws.
namespace slam_demo {
namespace {

using nlohmann::json;
namespace ev = gpureg::evaluation;

constexpr std::size_t kMapPoints = 40000;  // drawn of the map

/// Rows: the directions of largest, middle and least spread. The camera moves in the first two.
Eigen::Matrix3d principal_axes(const Trajectory& trajectory) {
  Eigen::Matrix3Xd points(3, static_cast<Eigen::Index>(trajectory.size()));
  for (Eigen::Index k = 0; k < points.cols(); ++k)
    points.col(k) = trajectory[static_cast<std::size_t>(k)].world_from_body.topRightCorner<3, 1>();
  if (points.cols() < 2) return Eigen::Matrix3d::Identity();
  points.colwise() -= points.rowwise().mean().eval();
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> solver(points * points.transpose());
  Eigen::Matrix3d axes = solver.eigenvectors().rowwise().reverse().transpose();
  axes.row(2) = axes.row(0).cross(axes.row(1));
  return axes;
}

/// A number with few digits: the page draws it.
double to_millimetres(double metres) { return std::round(1000 * metres) / 1000; }

json line_of(const char* name, const char* colour, const Trajectory& trajectory,
             const Eigen::Matrix4d& move) {
  json points = json::array();
  for (const ev::StampedPose& pose : trajectory) {
    const Eigen::Vector4d p = move * pose.world_from_body.col(3);
    points.push_back({to_millimetres(p.x()), to_millimetres(p.y())});
  }
  return {{"name", name}, {"colour", colour}, {"points", points}};
}

json errors_of(const char* colour, const ev::TrajectoryEvaluation& e) {
  json points = json::array();
  for (const ev::PoseError& pose : e.poses)
    points.push_back({to_millimetres(pose.time), std::round(1e5 * pose.metres) / 1e5});
  return {{"colour", colour}, {"points", points}};
}

/// Six numbers of a point: centimetres, red, green, blue.
json map_of(const surfel::Cloud& surfels, const Eigen::Matrix3d& axes) {
  json numbers = json::array();
  const std::size_t step = surfels.size() / kMapPoints + 1;
  for (std::size_t k = 0; k < surfels.size(); k += step) {
    const surfel::Surfel& s = surfels[k];
    const Eigen::Vector3d p = axes * Eigen::Vector3d(s.position.x, s.position.y, s.position.z);
    for (const double value : p) numbers.push_back(std::lround(100 * value));
    for (const int shift : {16, 8, 0}) numbers.push_back((s.colour >> shift) & 0xFFu);
  }
  return numbers;
}

constexpr const char* kHead = R"html(<!doctype html><html lang="en"><meta charset="utf-8">
<title>slam_demo</title>
<style>
body { font: 15px/1.5 system-ui, sans-serif; max-width: 920px; margin: 24px auto; padding: 0 12px }
table { border-collapse: collapse }
td, th { padding: 2px 12px; border-bottom: 1px solid #ccc; text-align: left }
svg, canvas { width: 100%; border: 1px solid #ccc }
</style>
<h1></h1><p id="summary"></p><table id="errors"></table>
<h2>Trajectory</h2><svg id="plan" viewBox="0 0 900 520"></svg>
<h2>Map</h2><p>Drag to turn, wheel to zoom.</p><canvas id="map" width="900" height="560"></canvas>
<h2>Position error over time</h2><svg id="chart" viewBox="0 0 900 260"></svg>
<h2>Milliseconds per frame</h2><table id="times"></table>
<h2>Loops</h2><table id="loops"></table>
<script>
const data = )html";

constexpr const char* kTail = R"html(;
const f = data.figures, get = id => document.getElementById(id);
document.querySelector('h1').textContent = f.sequence;
get('summary').textContent = `${f.frames_done} of ${f.frames} frames, ${f.frames_lost} lost, ` +
  `${f.keyframes} keyframes, ${f.fragments} fragments, ${f.worlds} connected part(s), ` +
  `${(f.frames_done / f.seconds).toFixed(1)} frames per second` +
  (f.surface ? `; map to true surface: mean ${f.surface.mean_m.toFixed(4)} m, median ` +
    `${f.surface.median_m.toFixed(4)} m` : '');
function table(id, head, rows) {
  for (const cells of [head, ...rows]) {
    const row = get(id).insertRow();
    for (const cell of cells)
      row.insertCell().textContent = typeof cell == 'number' ? +cell.toFixed(4) : cell;
  }
}
if (f.ate) table('errors', ['trajectory', 'RMSE (m)', 'median', 'max'],
  [['by tracking alone', f.ate_odometry], ['final', f.ate]].map(
    ([name, e]) => [name, e.rmse_m, e.median_m, e.max_m]));
table('times', ['part', ''], Object.entries(f.milliseconds).map(
  ([part, ms]) => [part, ms / Math.max(1, f.frames_done)]));
table('loops', ['fragments', 'seconds', 'state', 'reason', 'confidence', 'image loops'],
  f.loops.map(l => [`${l.source_fragment} → ${l.target_fragment}`,
    `${l.source_time_s.toFixed(1)} → ${l.target_time_s.toFixed(1)}`,
    l.state, l.reason, l.confidence, l.image_loops]));

function add(parent, kind, attributes, text) {
  const e = document.createElementNS(get(parent).namespaceURI, kind);
  for (const name in attributes) e.setAttribute(name, attributes[name]);
  e.textContent = text ?? '';
  get(parent).append(e);
}
// Lines in one scale (or one for each axis), from a corner of the drawing.
function draw(id, lines, width, height, same) {
  const all = lines.flatMap(l => l.points);
  if (!all.length) return add(id, 'text', {x: 20, y: 40}, 'No poses to show.');
  const low = [0, 1].map(a => all.reduce((m, p) => Math.min(m, p[a]), same ? 1e9 : a ? 0 : 1e9)),
    high = [0, 1].map(a => all.reduce((m, p) => Math.max(m, p[a]), -1e9));
  let sx = width / (high[0] - low[0] || 1), sy = height / (high[1] - low[1] || 1);
  if (same) sx = sy = Math.min(sx, sy);
  lines.forEach((l, k) => {
    add(id, 'polyline', {fill: 'none', stroke: l.colour, 'stroke-width': 1.5, points: l.points.map(
      p => `${(20 + sx * (p[0] - low[0])).toFixed(1)},` +
        `${(20 + height - sy * (p[1] - low[1])).toFixed(1)}`).join(' ')});
    if (l.name) add(id, 'text', {x: 760, y: 24 + 20 * k, fill: l.colour}, l.name);
  });
  const text = same ? `${(100 / sx).toFixed(2)} m` :
    `up to ${high[1].toFixed(3)} m, ${(high[0] - low[0]).toFixed(1)} s`;
  add(id, 'path', {d: `M20 ${height + 26}h${same ? 100 : width}`, stroke: '#888'});
  add(id, 'text', {x: 20, y: height + 38, fill: '#888', 'font-size': 12}, text);
}
draw('plan', data.lines, 860, 470, true);
draw('chart', data.errors, 860, 210, false);

const canvas = get('map'), context = canvas.getContext('2d'), P = data.map, n = P.length / 6;
const centre = [0, 1, 2].map(a => {
  let sum = 0;
  for (let i = 0; i < n; i++) sum += P[6 * i + a];
  return sum / Math.max(1, n);
});
let far = 1, yaw = 0.6, tilt = 0.9, zoom = 0.9;
for (let i = 0; i < 6 * n; i++)
  if (i % 6 < 3) far = Math.max(far, Math.abs(P[i] - centre[i % 6]));
function show() {
  const w = canvas.width, h = canvas.height, image = context.createImageData(w, h);
  const nearest = new Float32Array(w * h).fill(1e9), s = zoom * h / (2 * far);
  const [cy, sy, ct, st] = [Math.cos(yaw), Math.sin(yaw), Math.cos(tilt), Math.sin(tilt)];
  for (let i = 0; i < n; i++) {
    const [x, y, z] = [0, 1, 2].map(a => P[6 * i + a] - centre[a]);
    const right = x * cy - y * sy, back = x * sy + y * cy, depth = -(back * st + z * ct);
    const u = Math.round(w / 2 + s * right), v = Math.round(h / 2 + s * (back * ct - z * st));
    for (const k of [v * w + u, v * w + u + 1, (v + 1) * w + u, (v + 1) * w + u + 1]) {
      if (u < 0 || v < 0 || u > w - 2 || v > h - 2 || depth >= nearest[k]) continue;
      nearest[k] = depth;
      image.data.set([P[6 * i + 3], P[6 * i + 4], P[6 * i + 5], 255], 4 * k);
    }
  }
  context.putImageData(image, 0, 0);
}
canvas.onpointermove = e => {
  if (!e.buttons) return;
  yaw += e.movementX / 200;
  tilt -= e.movementY / 200;
  show();
};
canvas.onwheel = e => {
  e.preventDefault();
  zoom *= Math.exp(-e.deltaY / 800);
  show();
};
show();
</script></html>
)html";

}  // namespace

std::string report_page(const Slam& slam, const RunResult& r, const surfel::Cloud& surfels,
                        const json& figures) {
  const Trajectory final = slam.trajectory();
  const Eigen::Matrix3d axes = principal_axes(final);
  // Everything lies in the world of the final trajectory.
  Eigen::Matrix4d turn = Eigen::Matrix4d::Identity(), from_truth = turn, from_odometry = turn;
  turn.topLeftCorner<3, 3>() = axes;
  json lines = json::array();
  if (r.final.matched > 0) {
    from_truth = Eigen::Matrix4d(r.final.truth_from_estimate).inverse();
    from_odometry = from_truth * r.odometry.truth_from_estimate;
    lines.push_back(line_of("truth", "#888888", r.truth, turn * from_truth));
  }
  lines.push_back(line_of("tracking alone", "#c0392b", slam.odometry(), turn * from_odometry));
  lines.push_back(line_of("final", "#1e7a46", final, turn));
  const json data = {{"figures", figures},
                     {"lines", lines},
                     {"errors", {errors_of("#c0392b", r.odometry), errors_of("#1e7a46", r.final)}},
                     {"map", map_of(surfels, axes)}};
  std::string text = text_of(data, -1);
  // Names of files could end the script, or begin one; only strings have this character.
  for (std::size_t at = 0; (at = text.find('<', at)) != std::string::npos; ++at)
    text.replace(at, 1, "\\u003c");
  return kHead + text + kTail;
}

}  // namespace slam_demo
