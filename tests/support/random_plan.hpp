// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <random>
#include <vector>

#include "algorithm/plan.hpp"

namespace gpureg::test {

/// A map from above and scans, at random.
struct RandomPlan {
  static constexpr int kMargin = 28, kFineMargin = 2 * kMargin + 8;
  int width, height;  ///< coarse cells
  std::vector<std::uint32_t> coarse;
  std::vector<std::uint16_t> walls;
  struct ScanWalls {
    std::vector<plan::Wall> coarse, fine;
  };
  std::vector<ScanWalls> scan_walls;
  std::vector<plan::Scan> scans;

  RandomPlan(int w, int h, unsigned seed) : width(w), height(h), random_(seed) {
    const plan::Map map = view();
    coarse.assign(static_cast<std::size_t>(plan::kPlanes * map.coarse_rows * map.coarse_words), 0);
    walls.assign(static_cast<std::size_t>(map.rows * map.stride), 0);
    for (int k = 0; k < width * height / 3; ++k) add_wall(at(2 * width), at(2 * height), at(16));
    for (const int count : {3, 40, 255, 130, 8}) add_scan(count, count < 255);
    scans[1].low[0] = width / 3;  // a box
    scans[1].high[1] = height / 2;
    scans[3].high[0] = scans[3].low[0];  // an empty one
    scan_walls.emplace_back();           // no walls
    scans.push_back(plan::Scan{{}, {}, 16, true, {0, 0}, {width, height}});
  }

  plan::Map view() const {
    plan::Map map{};
    map.coarse = coarse.data();
    map.walls = walls.data();
    map.coarse_rows = height + 2 * kMargin;
    map.coarse_words = (width + 2 * kMargin) / 32 + 3;
    map.rows = 2 * height + 2 * kFineMargin;
    map.stride = 2 * width + 2 * kFineMargin;
    map.coarse_margin = kMargin;
    map.margin = kFineMargin;
    return map;
  }
  bool coarse_bit(int plane, int x, int y) const {
    const plan::Map map = view();
    const int row = plane * map.coarse_rows + kMargin + y, column = kMargin + x;
    return coarse[static_cast<std::size_t>(row * map.coarse_words + column / 32)] >> column % 32 &
           1;
  }
  std::uint32_t faces(int x, int y) const {
    return walls[static_cast<std::size_t>((kFineMargin + y) * view().stride + kFineMargin + x)];
  }

 private:
  int at(int below) { return std::uniform_int_distribution<int>(0, below - 1)(random_); }
  void add_wall(int x, int y, int direction) {
    const plan::Map map = view();
    walls[static_cast<std::size_t>((kFineMargin + y) * map.stride + kFineMargin + x)] |=
        static_cast<std::uint16_t>(1 << direction);
    for (const int plane : {direction, 16 + direction % 8}) {
      const int row = plane * map.coarse_rows + kMargin + y / 2, column = kMargin + x / 2;
      coarse[static_cast<std::size_t>(row * map.coarse_words + column / 32)] |= 1u << column % 32;
    }
  }
  void add_scan(int count, bool has_sides) {
    std::uniform_real_distribution<float> place(-18, 18), direction(-8, 8);
    ScanWalls made;
    for (int k = 0; k < count; ++k) {
      made.coarse.push_back({place(random_), place(random_), direction(random_)});
      const plan::Wall& wall = made.coarse.back();
      made.fine.push_back({2 * wall.x, 2 * wall.y, wall.direction});
    }
    for (int k = 0; k < count; ++k)  // more walls than a block holds
      if (count > 100) made.fine.push_back({place(random_), place(random_), direction(random_)});
    scan_walls.push_back(std::move(made));
    const int headings = 16 + at(30);
    scans.push_back(plan::Scan{span_of(scan_walls.back().coarse),
                               span_of(scan_walls.back().fine),
                               headings,
                               has_sides,
                               {0, 0},
                               {width, height}});
  }

  std::mt19937 random_;
};

}  // namespace gpureg::test

namespace gpureg::plan {
inline bool operator==(const Place& a, const Place& b) {
  return a.score == b.score && a.x == b.x && a.y == b.y && a.heading == b.heading;
}
}  // namespace gpureg::plan
