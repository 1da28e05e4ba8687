// SPDX-License-Identifier: BSD-3-Clause
#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <iterator>

#include "output.hpp"

/// report.html: one file, nothing loaded from elsewhere.
namespace slam_demo {
namespace {

constexpr std::size_t kMapPoints = 60000;  // drawn of the map

std::string format(const char* pattern, double value) {
  char text[64];
  std::snprintf(text, sizeof(text), pattern, value);
  return text;
}

std::string escape(const std::string& text) {
  std::string result;
  for (const char c : text) {
    if (c == '<')
      result += "&lt;";
    else if (c == '>')
      result += "&gt;";
    else if (c == '&')
      result += "&amp;";
    else
      result += c;
  }
  return result;
}

/// Rows: the directions of largest, middle and least spread. The camera moves in the first two.
Eigen::Matrix3d principal_axes(const std::vector<Eigen::Vector3d>& points) {
  Eigen::Vector3d mean = Eigen::Vector3d::Zero();
  for (const auto& p : points) mean += p;
  mean /= std::max<double>(1, static_cast<double>(points.size()));
  Eigen::Matrix3d covariance = Eigen::Matrix3d::Zero();
  for (const auto& p : points) covariance += (p - mean) * (p - mean).transpose();
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> solver(covariance);
  Eigen::Matrix3d axes;
  axes.row(0) = solver.eigenvectors().col(2).transpose();
  axes.row(1) = solver.eigenvectors().col(1).transpose();
  axes.row(2) = axes.row(0).cross(axes.row(1));
  return axes;
}

std::vector<Eigen::Vector3d> positions(const Trajectory& trajectory,
                                       const Eigen::Isometry3d& move) {
  std::vector<Eigen::Vector3d> result;
  for (const StampedPose& pose : trajectory)
    result.push_back(move * pose.world_from_camera.translation());
  return result;
}

/// Lines seen along the third axis, all to one scale.
struct Line {
  const char* name;
  const char* colour;
  std::vector<Eigen::Vector3d> points;
};
std::string plan(const std::vector<Line>& lines) {
  constexpr double kWidth = 900, kHeight = 520, kMargin = 20;
  std::vector<Eigen::Vector3d> all;
  for (const Line& line : lines) all.insert(all.end(), line.points.begin(), line.points.end());
  if (all.empty()) return "<p>No frame was tracked.</p>";
  const Eigen::Matrix3d axes = principal_axes(all);
  Eigen::Vector3d low = axes * all.front(), high = low;
  for (const auto& p : all) {
    low = low.cwiseMin(axes * p);
    high = high.cwiseMax(axes * p);
  }
  const double scale = std::min((kWidth - 2 * kMargin) / std::max(1e-3, high.x() - low.x()),
                                (kHeight - 2 * kMargin) / std::max(1e-3, high.y() - low.y()));
  std::string svg = "<svg viewBox='0 0 900 520' role='img'>";
  double y = 24;
  for (const Line& line : lines) {
    if (line.points.empty()) continue;
    svg += "<polyline fill='none' stroke-width='1.6' stroke='" + std::string(line.colour) +
           "' points='";
    for (const auto& p : line.points) {
      const Eigen::Vector3d q = scale * (axes * p - low);
      svg += format("%.1f,", kMargin + q.x()) + format("%.1f ", kMargin + q.y());
    }
    svg += "'/><text x='760' y='" + format("%.0f", y) + "' fill='" + line.colour + "'>" +
           line.name + "</text>";
    y += 20;
  }
  svg += "<path d='M20 505h" + format("%.1f", scale) + "' stroke='#888' stroke-width='3'/>" +
         "<text x='20' y='498' fill='#888'>1 m</text></svg>";
  return svg;
}

std::string error_chart(const AteResult& odometry, const AteResult& final) {
  if (final.errors.empty()) return "<p>No true trajectory was given.</p>";
  const double highest = std::max(0.01, std::max(odometry.max, final.max)),
               first = final.times.front(), length = std::max(1e-3, final.times.back() - first);
  std::string svg = "<svg viewBox='0 0 900 260' role='img'>";
  for (const auto& [ate, colour] :
       {std::pair{&odometry, "#c0392b"}, std::pair{&final, "#1e7a46"}}) {
    svg += "<polyline fill='none' stroke-width='1.4' stroke='" + std::string(colour) + "' points='";
    for (std::size_t k = 0; k < ate->errors.size(); ++k)
      svg += format("%.1f,", 60 + 820 * (ate->times[k] - first) / length) +
             format("%.1f ", 230 - 210 * ate->errors[k] / highest);
    svg += "'/>";
  }
  svg += "<path d='M60 20V230H880' fill='none' stroke='#888'/><text x='4' y='26'>" +
         format("%.3f m", highest) + "</text><text x='4' y='234'>0</text><text x='800' y='252'>" +
         format("%.1f s", length) + "</text></svg>";
  return svg;
}

std::string base64(const std::vector<std::uint8_t>& bytes) {
  static constexpr char kDigits[] =
      "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  std::string text;
  for (std::size_t k = 0; k < bytes.size(); k += 3) {
    const std::size_t left = std::min<std::size_t>(3, bytes.size() - k);
    std::uint32_t value = 0;
    for (std::size_t i = 0; i < 3; ++i)
      value = value << 8 | (i < left ? bytes[k + i] : std::uint8_t{0});
    for (std::size_t i = 0; i < 4; ++i)
      text += i <= left ? kDigits[(value >> (18 - 6 * i)) & 63u] : '=';
  }
  return text;
}

/// Points as 16-bit millimetres around the centre and three colours, for the script below.
std::string map_data(const surfel::Cloud& surfels, const Eigen::Matrix3d& axes) {
  std::vector<std::uint8_t> bytes;
  const std::size_t step = surfels.size() / kMapPoints + 1;
  Eigen::Vector3d centre = Eigen::Vector3d::Zero();
  double count = 0;
  const auto position = [&](std::size_t k) {
    const surfel::Vec& p = surfels[k].position;
    return Eigen::Vector3d(axes * Eigen::Vector3d(p.x, p.y, p.z));
  };
  for (std::size_t k = 0; k < surfels.size(); k += step, ++count) centre += position(k);
  centre /= std::max(1.0, count);
  for (std::size_t k = 0; k < surfels.size(); k += step) {
    const Eigen::Vector3d p = 1000 * (position(k) - centre);
    for (int axis = 0; axis < 3; ++axis) {
      const auto value = static_cast<std::int16_t>(std::clamp(p[axis], -32000.0, 32000.0));
      bytes.push_back(static_cast<std::uint8_t>(value & 0xFF));
      bytes.push_back(static_cast<std::uint8_t>((value >> 8) & 0xFF));
    }
    for (int shift = 16; shift >= 0; shift -= 8)
      bytes.push_back(static_cast<std::uint8_t>((surfels[k].colour >> shift) & 0xFFu));
  }
  return base64(bytes);
}

constexpr const char* kViewer = R"js(<script>
const raw=atob(document.getElementById('points').textContent),n=raw.length/9,c=document.getElementById('map'),g=c.getContext('2d');
const P=new Float32Array(3*n),C=new Uint8Array(3*n);let far=1;
for(let i=0;i<n;i++)for(let a=0;a<3;a++){let v=raw.charCodeAt(9*i+2*a)|raw.charCodeAt(9*i+2*a+1)<<8;if(v>32767)v-=65536;P[3*i+a]=v/1000;far=Math.max(far,Math.abs(v/1000));C[3*i+a]=raw.charCodeAt(9*i+6+a);}
let yaw=.6,tilt=.9,zoom=.9;
function draw(){const w=c.width,h=c.height,im=g.createImageData(w,h),z=new Float32Array(w*h).fill(1e9),s=zoom*h/(2*far),cy=Math.cos(yaw),sy=Math.sin(yaw),ct=Math.cos(tilt),st=Math.sin(tilt);
for(let i=0;i<n;i++){const x=P[3*i]*cy-P[3*i+1]*sy,y=P[3*i]*sy+P[3*i+1]*cy,q=P[3*i+2],u=Math.round(w/2+s*x),v=Math.round(h/2+s*(y*ct-q*st)),d=y*st+q*ct;
for(let a=0;a<2;a++)for(let b=0;b<2;b++){if(u+a<0||v+b<0||u+a>=w||v+b>=h)continue;const k=(v+b)*w+u+a;if(-d<z[k]){z[k]=-d;im.data.set([C[3*i],C[3*i+1],C[3*i+2],255],4*k);}}}
g.putImageData(im,0,0);}
c.onpointermove=e=>{if(e.buttons){yaw+=e.movementX/200;tilt-=e.movementY/200;draw();}};
c.onwheel=e=>{e.preventDefault();zoom*=Math.exp(-e.deltaY/800);draw();};draw();
</script>)js";

std::string row(const std::vector<std::string>& cells) {
  std::string text = "<tr>";
  for (const std::string& cell : cells) text += "<td>" + cell + "</td>";
  return text + "</tr>";
}

std::string ate_row(const char* name, const AteResult& ate) {
  return row({name, format("%.4f", ate.rmse), format("%.4f", ate.median), format("%.4f", ate.max)});
}

std::string summary(const Slam& slam, const RunResult& r) {
  const double count = std::max<double>(1, static_cast<double>(r.frames_done));
  std::string text = "<p>" + std::to_string(r.frames_done) + " of " + std::to_string(r.frames) +
                     " frames, " + std::to_string(slam.lost()) + " lost, " +
                     std::to_string(slam.map().keyframes.size()) + " keyframes, " +
                     std::to_string(slam.fragments()) + " fragments, " +
                     std::to_string(slam.worlds()) + " connected part(s), " +
                     format("%.1f frames per second.</p>", count / std::max(1e-9, r.seconds));
  if (r.final.poses >= 3) {
    text += "<table><tr><th>trajectory</th><th>RMSE (m)</th><th>median</th><th>max</th></tr>" +
            ate_row("by tracking alone", r.odometry) + ate_row("final", r.final) + "</table>";
  }
  if (r.surface.points > 0)
    text += "<p>Map to true surface: mean " + format("%.4f m", r.surface.mean) + ", median " +
            format("%.4f m", r.surface.median) + ".</p>";
  text += "<h2>Milliseconds per frame</h2><table>";
  for (const auto& [part, ms] : slam.milliseconds())
    text += row({part, format("%.2f", ms / count)});
  return text + row({"reading images", format("%.2f", r.load_milliseconds / count)}) + "</table>";
}

std::string loop_table(const Slam& slam) {
  std::string text =
      "<table><tr><th>fragments</th><th>seconds</th><th>state</th><th>reason</th>"
      "<th>confidence</th><th>image loops</th></tr>";
  for (const LoopRecord& loop : slam.loops().records()) {
    text += row({std::to_string(loop.source) + " &rarr; " + std::to_string(loop.target),
                 format("%.1f", loop.source_time) + " &rarr; " + format("%.1f", loop.target_time),
                 loop.state, loop.reason, format("%.3f", loop.confidence),
                 std::to_string(loop.image_loops)});
  }
  return text + "</table>";
}

}  // namespace

std::string report_page(const Slam& slam, const RunResult& r, const surfel::Cloud& surfels) {
  const Trajectory final = slam.trajectory();
  const bool truth = r.final.poses >= 3;
  const std::vector<Eigen::Vector3d> path = positions(final, Eigen::Isometry3d::Identity());
  std::vector<Line> lines;
  if (truth) lines.push_back({"truth", "#888", positions(r.truth, Eigen::Isometry3d::Identity())});
  lines.push_back(
      {"tracking alone", "#c0392b", positions(slam.odometry(), r.odometry.truth_from_estimate)});
  lines.push_back({"final", "#1e7a46", positions(final, r.final.truth_from_estimate)});
  return "<!doctype html><html lang='en'><meta charset='utf-8'><title>slam_demo</title><style>"
         "body{font:15px/1.5 system-ui,sans-serif;max-width:920px;margin:24px auto;padding:0 12px}"
         "table{border-collapse:collapse}td,th{padding:2px 12px;border-bottom:1px solid #ccc;"
         "text-align:left}svg,canvas{width:100%;border:1px solid #ccc}</style><h1>" +
         escape(r.sequence) + "</h1>" + summary(slam, r) + "<h2>Trajectory</h2>" + plan(lines) +
         "<h2>Map</h2><p>Drag to turn, wheel to zoom.</p><canvas id='map' width='900' "
         "height='560'></canvas><script type='text/plain' id='points'>" +
         map_data(surfels, principal_axes(path)) + "</script>" + kViewer +
         "<h2>Position error over time</h2>" + error_chart(r.odometry, r.final) + "<h2>Loops</h2>" +
         loop_table(slam) + "</html>\n";
}

}  // namespace slam_demo
