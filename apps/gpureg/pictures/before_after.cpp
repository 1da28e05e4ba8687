// SPDX-License-Identifier: BSD-3-Clause
#include "pictures/before_after.hpp"

#include "pictures/render.hpp"
#include "pictures/view.hpp"
#include "text.hpp"

namespace gpureg::cli {
namespace {

constexpr Color kYellow = {255, 178, 26}, kBlue = {38, 139, 230}, kInk = {60, 60, 60},
                kLine = {215, 215, 210}, kPaper = {250, 250, 248};
constexpr int kTextScale = 2, kBar = 30, kMargin = 10;

int legend(Image& image, int x, Color color, const std::string& text) {
  fill(image, x, 9, 12, 12, color);
  draw_text(image, x + 18, 8, kTextScale, kInk, text);
  return x + 18 + text_width(text, kTextScale) + 20;
}

}  // namespace

PosedTitle pose_of(const RegistrationResult& result) {
  if (!result.has_pose()) return {std::nullopt, "after: no pose found", nullptr};
  const std::string confidence = "(confidence " + fixed(result.confidence, 2) + ")";
  return {result.target_from_source,
          result.aligned() ? "after: aligned " + confidence : "after: rejected " + confidence,
          nullptr};
}

Image before_after(const PointCloud& source, const PointCloud& target, const PosedTitle& after,
                   int panel_width, int panel_height) {
  const Eigen::Matrix3d view = choose_view(target);
  const auto panel = [&](const PointCloud& moved, const Eigen::Isometry3d& pose) {
    return render({{&moved, pose, kYellow}, {&target, Eigen::Isometry3d::Identity(), kBlue}}, view,
                  panel_width, panel_height);
  };
  Image image(2 * panel_width + 1, panel_height + kBar, kPaper);
  paste(image, panel(after.unscaled ? *after.unscaled : source, Eigen::Isometry3d::Identity()), 0,
        kBar);
  if (after.target_from_source)
    paste(image, panel(source, *after.target_from_source), panel_width + 1, kBar);
  fill(image, panel_width, 0, 1, image.height, kLine);
  fill(image, 0, kBar - 1, image.width, 1, kLine);

  draw_text(image, kMargin, 8, kTextScale, kInk, "before");
  int x = kMargin + text_width("before", kTextScale) + 30;
  x = legend(image, x, kYellow, "source");
  legend(image, x, kBlue, "target");
  draw_text(image, panel_width + kMargin, 8, kTextScale, kInk, after.title);
  return image;
}

}  // namespace gpureg::cli
