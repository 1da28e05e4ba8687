// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <cmath>
#include <functional>
#include <queue>

#include "data/trajectory.hpp"

namespace gpureg::synthetic {
namespace {

using Eigen::Vector2f;

constexpr float kTall = 1.15f;  // metres; the camera is carried over what is lower

constexpr float kComfortable = 2;  // cost of a cell half a metre from walls, without furniture

bool contains(const Rect& r, const Vector2f& p, float margin) {
  return (p.array() > r.low.array() - margin).all() && (p.array() < r.high.array() + margin).all();
}

}  // namespace

WalkMap::WalkMap(const House& house) {
  Vector2f low = Vector2f::Constant(1e9f), high = -low;
  for (const Room& room : house.rooms) {
    low = low.cwiseMin(room.floor.low);
    high = high.cwiseMax(room.floor.high);
  }
  origin_ = low;
  columns_ = static_cast<int>(std::ceil((high.x() - low.x()) / kCell));
  rows_ = static_cast<int>(std::ceil((high.y() - low.y()) / kCell));
  const int cells = columns_ * rows_;
  std::vector<std::uint8_t> solid(static_cast<std::size_t>(cells), 1);  // a wall or tall furniture
  cost_.assign(static_cast<std::size_t>(cells), 0.0f);
  std::vector<std::uint8_t> low_furniture(static_cast<std::size_t>(cells), 0);
  for (int cell = 0; cell < cells; ++cell) {
    const Vector2f p = centre(cell);
    const auto i = static_cast<std::size_t>(cell);
    for (const Room& room : house.rooms) {
      if (contains(room.floor, p, 0)) solid[i] = 0;
    }
    for (const Doorway& door : house.doors) {
      const Vector2f d = p - door.centre, across(-door.through.y(), door.through.x());
      if (std::abs(d.dot(door.through)) < 0.2f && std::abs(d.dot(across)) < 0.42f) solid[i] = 0;
    }
    for (const Obstacle& obstacle : house.obstacles) {
      if (obstacle.height > kTall && contains(obstacle.rect, p, 0)) solid[i] = 1;
      if (obstacle.height > 0.3f && contains(obstacle.rect, p, 0.15f)) low_furniture[i] = 1;
    }
  }
  constexpr int kReach = 6;
  for (int cell = 0; cell < cells; ++cell) {
    const int x = cell % columns_, y = cell / columns_;
    float nearest = 0.1f * kReach;
    for (int dy = -kReach; dy <= kReach; ++dy) {
      for (int dx = -kReach; dx <= kReach; ++dx) {
        const int nx = x + dx, ny = y + dy;
        const bool outside = nx < 0 || ny < 0 || nx >= columns_ || ny >= rows_;
        if (!outside && solid[static_cast<std::size_t>(ny * columns_ + nx)] == 0) continue;
        nearest = std::min(nearest, kCell * std::sqrt(static_cast<float>(dx * dx + dy * dy)));
      }
    }
    if (nearest < 0.25f) continue;
    cost_[static_cast<std::size_t>(cell)] =
        1 + 8 * (0.6f - nearest) + (low_furniture[static_cast<std::size_t>(cell)] ? 8.0f : 0.0f);
  }
}

int WalkMap::cell_of(const Vector2f& p) const {
  const int x = static_cast<int>(std::floor((p.x() - origin_.x()) / kCell)),
            y = static_cast<int>(std::floor((p.y() - origin_.y()) / kCell));
  return x < 0 || y < 0 || x >= columns_ || y >= rows_ ? -1 : y * columns_ + x;
}

Vector2f WalkMap::centre(int cell) const {
  return origin_ + kCell * Vector2f(static_cast<float>(cell % columns_) + 0.5f,
                                    static_cast<float>(cell / columns_) + 0.5f);
}

bool WalkMap::free(const Vector2f& p) const {
  const int cell = cell_of(p);
  return cell >= 0 && cost_[static_cast<std::size_t>(cell)] > 0 &&
         cost_[static_cast<std::size_t>(cell)] < kComfortable;
}

std::vector<Vector2f> WalkMap::path(const Vector2f& from, const Vector2f& to) const {
  const int start = cell_of(from), goal = cell_of(to);
  if (start < 0 || goal < 0) return {};
  using Entry = std::pair<float, int>;
  std::priority_queue<Entry, std::vector<Entry>, std::greater<>> open;
  std::vector<float> best(cost_.size(), 1e30f);
  std::vector<int> parent(cost_.size(), -1);
  best[static_cast<std::size_t>(start)] = 0;
  open.push({0, start});
  while (!open.empty()) {
    const auto [reached, cell] = open.top();
    open.pop();
    if (cell == goal) break;
    if (reached > best[static_cast<std::size_t>(cell)]) continue;
    const int x = cell % columns_, y = cell / columns_;
    for (int dy = -1; dy <= 1; ++dy) {
      for (int dx = -1; dx <= 1; ++dx) {
        const int nx = x + dx, ny = y + dy;
        if ((dx == 0 && dy == 0) || nx < 0 || ny < 0 || nx >= columns_ || ny >= rows_) continue;
        const int next = ny * columns_ + nx;
        const float step = cost_[static_cast<std::size_t>(next)];
        if (step <= 0) continue;
        const float cost = reached + step * (dx != 0 && dy != 0 ? 1.41421356f : 1.0f);
        if (cost >= best[static_cast<std::size_t>(next)]) continue;
        best[static_cast<std::size_t>(next)] = cost;
        parent[static_cast<std::size_t>(next)] = cell;
        open.push({cost, next});
      }
    }
  }
  if (goal != start && parent[static_cast<std::size_t>(goal)] < 0) return {};
  std::vector<Vector2f> line;
  for (int cell = goal; cell >= 0; cell = parent[static_cast<std::size_t>(cell)])
    line.push_back(centre(cell));
  std::reverse(line.begin(), line.end());
  return line;
}

}  // namespace gpureg::synthetic
