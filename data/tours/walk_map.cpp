// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <cmath>
#include <functional>
#include <queue>
#include <string>

#include "gpureg/error.hpp"

#include "data/tours/walk_map.hpp"

namespace gpureg::synthetic {
namespace {

using Eigen::Vector2f;

constexpr float kTall = 1.15f;  // metres; the camera passes above lower things

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
  lay_out(low, high);
  std::vector<std::uint8_t> solid(cost_.size(), 1), low_furniture(cost_.size(), 0);
  for (int cell = 0; cell < columns_ * rows_; ++cell) {
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
  price(solid, low_furniture);
}

WalkMap::WalkMap(const RayScene& scene) {
  constexpr float kLargest = 150;              // metres
  constexpr float kNear = 0.1f, kFar = 30;     // metres: stands in this cell; walls a place in
  constexpr int kDirections = 8, kWalled = 6;  // a window or two may look outside
  Vector2f low = Vector2f::Constant(1e9f), high = -low;
  for (const Eigen::Vector3f& v : scene.mesh().vertices) {
    low = low.cwiseMin(v.head<2>());
    high = high.cwiseMax(v.head<2>());
  }
  if (!((high - low).maxCoeff() <= kLargest)) {
    throw InvalidArgument("building is " + std::to_string((high - low).maxCoeff()) +
                          " m long, but must be 150 m at most (coordinates are metres)");
  }
  lay_out(low, high);
  std::vector<std::uint8_t> solid(cost_.size(), 1), low_furniture(cost_.size(), 0);
  for (int cell = 0; cell < columns_ * rows_; ++cell) {
    const Vector2f p = centre(cell);
    const auto i = static_cast<std::size_t>(cell);
    const RayHit down = scene.cast({p.x(), p.y(), kHeadroom}, {0, 0, -1});
    const float height = kHeadroom - down.t;
    if (!down.hit || height < -0.3f || height > kTall) continue;
    int walls = 0;
    bool blocked = false;
    for (const float level : {kTall, 1.45f, 1.75f}) {
      for (int k = 0; k < kDirections && !blocked; ++k) {
        const float angle = 6.2831853f * static_cast<float>(k) / kDirections;
        const RayHit hit = scene.cast({p.x(), p.y(), level}, {std::cos(angle), std::sin(angle), 0});
        blocked = hit.hit && hit.t < kNear;
        if (level == kTall && hit.hit && hit.t < kFar) ++walls;
      }
      if (blocked || walls < kWalled) break;
    }
    if (blocked || walls < kWalled) continue;
    solid[i] = 0;
    low_furniture[i] = height > 0.3f;
  }
  price(solid, low_furniture);
  keep_largest_area();
  if (free_places().empty()) {
    throw InvalidArgument(
        "building has no place to walk: none with a floor at z = 0, headroom of 1.9 m, half a "
        "metre "
        "of room and walls around (coordinates are metres, z up)");
  }
}

void WalkMap::lay_out(const Vector2f& low, const Vector2f& high) {
  origin_ = low;
  columns_ = static_cast<int>(std::ceil((high.x() - low.x()) / kCell));
  rows_ = static_cast<int>(std::ceil((high.y() - low.y()) / kCell));
  cost_.assign(static_cast<std::size_t>(columns_) * static_cast<std::size_t>(rows_), 0.0f);
}

void WalkMap::price(const std::vector<std::uint8_t>& solid,
                    const std::vector<std::uint8_t>& low_furniture) {
  constexpr int kReach = 6;
  for (int cell = 0; cell < columns_ * rows_; ++cell) {
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

void WalkMap::keep_largest_area() {
  std::vector<int> area(cost_.size(), -1), sizes;
  for (int start = 0; start < columns_ * rows_; ++start) {
    const auto s = static_cast<std::size_t>(start);
    if (cost_[s] <= 0 || area[s] >= 0) continue;
    const int number = static_cast<int>(sizes.size());
    std::vector<int> open{start};
    area[s] = number;
    for (std::size_t k = 0; k < open.size(); ++k) {
      const int x = open[k] % columns_, y = open[k] / columns_;
      for (int ny = std::max(0, y - 1); ny <= std::min(rows_ - 1, y + 1); ++ny) {
        for (int nx = std::max(0, x - 1); nx <= std::min(columns_ - 1, x + 1); ++nx) {
          const auto next = static_cast<std::size_t>(ny * columns_ + nx);
          if (cost_[next] <= 0 || area[next] >= 0) continue;
          area[next] = number;
          open.push_back(static_cast<int>(next));
        }
      }
    }
    sizes.push_back(static_cast<int>(open.size()));
  }
  const auto largest =
      static_cast<int>(std::max_element(sizes.begin(), sizes.end()) - sizes.begin());
  for (std::size_t i = 0; i < cost_.size(); ++i) {
    if (area[i] != largest) cost_[i] = 0;
  }
}

bool WalkMap::walkable(const Vector2f& p) const {
  const int cell = cell_of(p);
  return cell >= 0 && cost_[static_cast<std::size_t>(cell)] > 0;
}

std::vector<Vector2f> WalkMap::free_places() const {
  std::vector<Vector2f> places;
  for (int cell = 0; cell < columns_ * rows_; ++cell) {
    if (free(centre(cell))) places.push_back(centre(cell));
  }
  return places;
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
